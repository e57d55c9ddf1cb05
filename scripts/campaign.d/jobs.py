"""kill -9 of the daemon, or of a job, at random moments (scripts/kill_jobs)."""
from common.scripts import run_script

TIERS = ("ci", "gate", "campaign")
ASKED = "E2, for jobs: nothing lost that was accepted, no wrong result"
WHY_NOT = ""


def run(run):
    run_script(run, ["kill_jobs", {"ci": 10, "gate": 100, "campaign": 500}[run.tier], run.seed], r"^(\d+) kills")
