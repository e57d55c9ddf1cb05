"""kill -9 before every system call by which a build changes its folder (scripts/kill_everywhere)."""
from common import programme
from common.scripts import run_script

TIERS = ("gate", "campaign")
ASKED = "E1: a kill at every state-changing call of a build, an update and a merge; the same bytes when run again"
WHY_NOT = "the 500 random kills of a 20,000-tile build are not here"


def run(run):
    programme.needs("strace", "gdal_translate")
    run_script(run, ["kill_everywhere"], r"^(\d+) states")
