"""kill -9 before every system call by which a build, a shard, a merge or a copy changes its folder (scripts/kill_everywhere)."""
from common import programme
from common.scripts import run_script

TIERS = ("gate", "campaign")
ASKED = "E1, E2: a kill at every state-changing call of a build, an update and a merge; 500 at random moments of a build of 20,000 tiles; the same bytes when run again"
WHY_NOT = ("at the gate 100 of the 500 random kills; no build of four workers of which one is killed over and over; a build writes its ledger every "
           "so often, and has more calls while they are listed on a busy machine: those that came no more are counted apart (those of seed 71 "
           "that its log kept were such)")


def run(run):
    programme.needs("strace", "gdal_translate")
    run_script(run, ["kill_at_random", 100 if run.tier == "gate" else 500, run.seed], r"^(\d+) kills")
    run_script(run, ["kill_everywhere"], r"^(\d+) states")
