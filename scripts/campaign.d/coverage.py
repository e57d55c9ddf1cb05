"""Lines of the parsers, the formats and the pyramid that their tests run (scripts/coverage)."""
import json
import subprocess

from common import figures, programme
from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "A3: 95 % of the lines of proto, http and pyramid"
WHY_NOT = "lines, not branches; three rooms, not all; of each room only its own tests are counted (of server/http those of server/api, too)"
GOAL = 95


def REACHED(rows):
    latest = {room: (percent, lines) for room, percent, lines in figures.numbers(r"(\S+) ([\d.]+) % of ([\d,]+) lines", rows)}
    return {"A3": ", ".join(f"{room} {percent} % of {lines:,}" for room, (percent, lines) in latest.items()) + " lines"}


def run(run):
    programme.needs("gcovr", "gcov")
    done = subprocess.run([ROOT / "scripts/coverage", "--json"], capture_output=True, text=True)
    if done.returncode:
        run.fail(done.stderr.strip()[-500:])
        return
    for room in ("proto", "server/http", "terrain/pyramid"):
        one = json.loads(done.stdout)["folders"][room]
        run.executions += one["lines"]
        run.note(f"{room} {one['percent']} % of {one['lines']:,} lines")
        if one["percent"] < GOAL:
            run.fail(f"{room}: {one['percent']} %")
