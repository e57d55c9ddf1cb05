"""Every fuzz target under libFuzzer with ASan and UBSan, from the corpus of the repository (scripts/fuzz)."""
import os
import re
import subprocess

from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "C: every reader of outside bytes, 0 crashes; 100 M to 500 M inputs a target in the end; corpus of 5 MB at most"
WHY_NOT = "as many inputs as the seconds given allow; in ctest the seeds and 300 mutations of each are replayed"


def run(run):
    targets = sorted(path.stem for path in ROOT.glob("tests/**/*_fuzz.cpp"))
    run.rng.shuffle(targets)
    each = max(5, int(run.seconds * os.cpu_count() / len(targets)))  # one runs on each core
    done = subprocess.run([ROOT / "scripts/fuzz", str(each), *targets], capture_output=True, text=True)
    executed = [int(n) for n in re.findall(r"number_of_executed_units: *(\d+)", done.stdout)]
    run.executions += sum(executed)
    run.note(f"{len(targets)} targets of {each} s each, {len(executed)} without a crash")
    size = sum(p.stat().st_size for p in (ROOT / "testdata/fuzz").rglob("*") if p.is_file())
    run.note(f"corpus {size / 1e6:.2f} MB")
    if size > 5e6:
        run.fail("the corpus is larger than 5 MB")
    for line in re.findall(r"fuzz: .*FAILED.*", done.stderr):
        run.fail(line)
    if done.returncode and not run.wrong:
        run.fail(done.stderr.strip()[-500:])
