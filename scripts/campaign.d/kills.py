"""kill -9 before every system call by which a build, a shard, a merge or a copy changes its folder (scripts/kill_everywhere)."""
from common import programme
from common.figures import numbers, span
from common.scripts import run_script

TIERS = ("gate", "campaign")
ASKED = "E1, E2: a kill at every state-changing call of a build, an update and a merge; 500 at random moments of a build of 20,000 tiles; the same bytes when run again"
WHY_NOT = ("at the gate 100 of the 500 random kills; no build of four workers of which one is killed over and over; a build writes its ledger every "
           "so often, and has more calls while they are listed on a busy machine: those that came no more are counted apart (those of seed 71 "
           "that its log kept were such)")


def REACHED(rows):
    states, at_random = numbers(r"(\d+) states, (\d+) folders not as wanted", rows), numbers(r"(\d+) kills of a build of ([\d,]+) tiles.*?, (\d+) times", rows)
    found = {}
    if states:
        found["E1"] = (f"{span([n for n, _ in states])} states a row, {sum(n for n, _ in states):,} in all; folders not as wanted: {states[-1][1]} in the last row"
                       + (f", {sum(bad for _, bad in states)} in all" if len(states) > 1 else ""))
    if at_random:
        found["E2"] = (f"{sum(n for n, *_ in at_random):,} kills of a build of {span([tiles for _, tiles, _ in at_random])} tiles, "
                       f"{sum(bad for *_, bad in at_random)} times other bytes")
    return found


def run(run):
    programme.needs("strace", "gdal_translate")
    run_script(run, ["kill_at_random", 100 if run.tier == "gate" else 500, run.seed], r"^(\d+) kills")
    run_script(run, ["kill_everywhere"], r"^(\d+) states")
