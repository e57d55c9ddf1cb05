"""clang-tidy over the sources: bugprone, concurrency, performance and others (scripts/tidy, .clang-tidy)."""
from common import programme
from common.scripts import run_script

TIERS = ("campaign",)
ASKED = "A1: clang-tidy bugprone, concurrency, performance: 0 findings"
WHY_NOT = "checks that are not for this code are left out in .clang-tidy, with their names"


def run(run):
    programme.needs("clang-tidy-19", "clang++-19")
    run_script(run, ["tidy", "--seconds", run.seconds, "--seed", run.seed], r"^(\d+) of \d+ files")
