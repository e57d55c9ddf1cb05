"""The tests under ThreadSanitizer, and under ASan and UBSan, which CI has in the rooms that scripts/check names."""
import collections
import os
import re
import subprocess
import time

from common import figures, ledger
from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "A2: all tests under ASan and UBSan, and under TSan: 0 reports; suppressions for named frames of others only"
WHY_NOT = ("not on one day and commit, but folder after folder as the seconds allow; UBSan is without integer, float-cast-overflow, vptr, null and alignment; valgrind is not run; "
           "the clients' tests are left out: they test what crosses the wire; so are some tests that take minutes "
           "under sanitizers and go where their neighbours go; tests/support/tsan.supp names what is suppressed")
SLOW = ("*power_cut*", "*a_file_that_comes_or_goes*", "*another_blend*", "*by_every_method*", "*of_hard_shapes*",
        "*MethodTiles*", "*a_long_thin_dem*", "*LargerThanItsMemory*", "*ABigStreamIsAValidMesh*",
        "*NeverTakesItBeyondTheError*", "*AnErrorThatNamesBoth*", "*OfALargeDem*", "*ComparesTilesByMethodAndLevel*",
        "*OverATenMegabitLink*", "*IndexedLayeredUpdate*", "*LayeredUpdates.end_as*",
        "*that_rest_on_the_residual_index*", "*IndexedTiles.are_the_same*", "*Bucket.OfAProjectedDem*",
        "*WhatSimplifyStatesIsWhatMeasureFinds*", "*Feet.AreMetresInImages*")


def REACHED(rows):
    found = []
    for preset in ("asan", "tsan"):
        folders = set(", ".join(names for names, in figures.numbers(preset + r": \d+ of \d+ folders of tests \(([^)]+)\)", rows)).split(", "))
        every = figures.numbers(preset + r": \d+ of (\d+) folders", rows)
        reports = figures.numbers(preset + r": [^;]*?(\d+) reports", rows)
        found.append(f"{preset}: {len(folders)} of {every[-1][0]} folders of tests, reports: {sum(n for n, in reports)} in all rows, {reports[-1][0]} in the last" if reports else f"{preset}: -")
    return {"A2": "; ".join(found)}


def programs():
    """Of each folder of tests, and of the fuzz targets' seeds: the folder's name in ctest, and what is to be built."""
    folders = {str(path.parent.relative_to(ROOT / "tests")) for path in (ROOT / "tests").rglob("*_test.cpp") if "node_modules" not in path.parts}
    return [(folder, folder.replace("/", "_") + "_test") for folder in sorted(folders)] + [(name, name) for name in ("fuzz_replay", "fuzz_replay_server")]


def look(run, preset, folder, program):
    """How many groups of its tests ran, and what sanitizers said of them. Other programs' groups are not built yet."""
    built = subprocess.run([ROOT / "scripts/build", preset, program], capture_output=True, text=True)
    if built.returncode:
        run.fail(f"{preset}: {program}: {(built.stdout + built.stderr).strip()[-500:]}")
        return 0, set()
    done = subprocess.run(["ctest", "--test-dir", ROOT / "build" / preset, "-R", f"^{re.escape(folder)}/[a-z_0-9]+$", "-LE", "client",
                           "-j", str(os.cpu_count()), "--output-on-failure"], capture_output=True, text=True, stdin=subprocess.DEVNULL,
                          env=os.environ | {"GTEST_FILTER": "-" + ":".join(SLOW)})
    verdicts = re.findall(r"^\s*\d+/\d+ Test +#\d+: (\S+) \.+ *\**(\w+)", done.stdout, re.M)
    reports = set(re.findall(r"SUMMARY: \w+Sanitizer: .*|^\S+: runtime error: .*", done.stdout, re.M))
    for report in sorted(reports):
        run.fail(f"{preset}: {folder}: {report}")
    failed = sorted(set(re.findall(r"\[  FAILED  \] ([\w/]+\.[\w/]+)", done.stdout)))
    wrong = [name for name, verdict in verdicts if verdict != "Passed"]
    if (wrong or done.returncode) and not reports:
        run.fail(f"{preset}: {folder}: {' '.join(failed or wrong) or done.stdout.strip()[-300:]}")
    return len(verdicts), reports


def looks(preset):
    """How often rows of the ledger name each folder as looked at."""
    count = collections.Counter()
    for row in ledger.rows():
        for named in re.findall(preset + r": \d+ of \d+ folders of tests \(([^)]+)\)", row[7]) if row[3] == "sanitizers" else ():
            count.update(named.split(", "))
    return count


def run(run):
    """Folder after folder: first those that the ledger names least often, of these in an order of the seed; an odd seed
    begins with TSan, an even one with ASan. The second has what the first leaves of the time, with the building. What was
    built stays."""
    end = time.monotonic() + run.seconds
    for preset in ("tsan", "asan") if run.seed % 2 else ("asan", "tsan"):
        before = looks(preset)
        every = sorted(run.sample(programs(), 1), key=lambda one: before[one[0]])
        looked_at, groups, said = [], 0, set()
        for folder, program in every:
            if time.monotonic() > end:
                break
            count, reports = look(run, preset, folder, program)
            groups, said, looked_at = groups + count, said | reports, looked_at + [folder]
            print(f"  {preset}: {folder}: {count} groups of tests, {len(reports)} reports", flush=True)
        run.executions += groups
        if looked_at:
            run.note(f"{preset}: {len(looked_at)} of {len(every)} folders of tests ({', '.join(sorted(looked_at))}), {groups} groups, {len(said)} reports; "
                     f"{len({name for name, _ in every} & (before.keys() | set(looked_at)))} of them in all rows")
