"""kill -9 before every system call by which a build changes its folder (scripts/kill_everywhere)."""
from common import programme
from common.scripts import run_script

TIERS = ("gate", "campaign")
ASKED = "E1, E2: a kill at every state-changing call of a build, an update and a merge; 500 at random moments of a build of 20,000 tiles; the same bytes when run again"
WHY_NOT = "a build writes its ledger every so often, and has more calls while they are listed on a busy machine: those of seed 71 that its log kept were such, whose build was at its end before (alone it has 174 calls, 0 wrong); they are counted apart now"


def run(run):
    programme.needs("strace", "gdal_translate")
    run_script(run, ["kill_at_random", 100 if run.tier == "gate" else 500, run.seed], r"^(\d+) kills")
    run_script(run, ["kill_everywhere"], r"^(\d+) states")
