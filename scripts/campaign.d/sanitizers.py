"""The tests under ThreadSanitizer; ASan and UBSan have them in every run of CI (scripts/check)."""
import re
import subprocess

from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "A2: all tests under ASan and UBSan, and under TSan: 0 reports; suppressions for named frames of others only"
WHY_NOT = "the clients' tests are left out: they test what crosses the wire; tests/support/tsan.supp names what is suppressed"


def run(run):
    done = subprocess.run([ROOT / "scripts/test", "tsan", "-LE", "client"], capture_output=True, text=True)
    found = re.findall(r"^\s*\d+/\d+ Test +#\d+: (\S+) \.+ *(\S+)", done.stdout, re.M)
    run.executions += len(found)
    for name, verdict in found:
        if verdict != "Passed":
            run.fail(f"{name}: {verdict}")
    reports = sorted(set(re.findall(r"SUMMARY: ThreadSanitizer: (.*)", done.stdout)))
    run.note(f"{len(found)} groups of tests, {len(reports)} reports of TSan")
    for report in reports:
        run.fail(report)
    if done.returncode and not run.wrong:
        run.fail((done.stdout + done.stderr).strip()[-500:])
