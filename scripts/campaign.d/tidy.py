"""clang-tidy over the sources: bugprone, concurrency, performance and others (scripts/tidy, .clang-tidy)."""
from common import figures, programme
from common.scripts import run_script

TIERS = ("campaign",)
ASKED = "A1: clang-tidy bugprone, concurrency, performance: 0 findings"
WHY_NOT = "cert and most of concurrency are not on; checks that are not for this code are left out in .clang-tidy, with their names; several files are looked at as one, without clang's analyzer"


def REACHED(rows):
    most = max(figures.numbers(r"(\d+) of (\d+) files", rows))
    return {"A1": f"{most[0]} of {most[1]} files in one row; {figures.numbers(r'([0-9]+) findings', rows)[-1][0]} findings at the end of the last"}


def run(run):
    programme.needs("clang-tidy-19", "clang++-19")
    run_script(run, ["tidy", "--seconds", run.seconds, "--seed", run.seed], r"^(\d+) of \d+ files")
