"""kill -9 of the daemon, or of a job, at random moments (scripts/kill_jobs)."""
from common import figures
from common.scripts import run_script

TIERS = ("ci", "gate", "campaign")
ASKED = "E2, for jobs: nothing lost that was accepted, no wrong result"
WHY_NOT = "jobs of one kind, simplify, of one DEM"


def REACHED(rows):
    found = figures.numbers(r"(\d+) kills \((\d+) of the daemon, (\d+) of a job\): (\d+) jobs.*?, (\d+) wrong", rows)
    return {"E2": f"{sum(n for n, *_ in found):,} kills of daemons and jobs: {sum(jobs for *_, jobs, _ in found):,} jobs, {sum(bad for *_, bad in found)} lost or wrong"}


def run(run):
    run_script(run, ["kill_jobs", {"ci": 10, "gate": 100, "campaign": 500}[run.tier], run.seed], r"^(\d+) kills")
