"""The tests under ASan and UBSan, then under ThreadSanitizer. CI has the first in the rooms that scripts/check names."""
import os
import re
import subprocess

from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "A2: all tests under ASan and UBSan, and under TSan: 0 reports; suppressions for named frames of others only"
WHY_NOT = ("the clients' tests are left out: they test what crosses the wire; so are some tests that take minutes "
           "under sanitizers and go where their neighbours go; tests/support/tsan.supp names what is suppressed")
SLOW = ("*power_cut*", "*a_file_that_comes_or_goes*", "*another_blend*", "*by_every_method*", "*of_hard_shapes*",
        "*MethodTiles*", "*a_long_thin_dem*", "*LargerThanItsMemory*", "*ABigStreamIsAValidMesh*",
        "*NeverTakesItBeyondTheError*", "*AnErrorThatNamesBoth*", "*OfALargeDem*", "*ComparesTilesByMethodAndLevel*",
        "*OverATenMegabitLink*", "*IndexedLayeredUpdate*", "*LayeredUpdates.end_as*",
        "*that_rest_on_the_residual_index*", "*IndexedTiles.are_the_same*", "*Bucket.OfAProjectedDem*",
        "*WhatSimplifyStatesIsWhatMeasureFinds*", "*Feet.AreMetresInImages*")


def run(run):
    for preset in ("asan", "tsan"):
        done = subprocess.run([ROOT / "scripts/test", preset, "-LE", "client"], capture_output=True, text=True,
                              env=os.environ | {"GTEST_FILTER": "-" + ":".join(SLOW)})
        found = re.findall(r"^\s*\d+/\d+ Test +#\d+: (\S+) \.+ *(\S+)", done.stdout, re.M)
        run.executions += len(found)
        wrong = [f"{preset}: {name}: {verdict}" for name, verdict in found if verdict != "Passed"]
        reports = sorted(set(re.findall(r"SUMMARY: \w+Sanitizer: (.*)|(\S+: runtime error: .*)", done.stdout)))
        wrong += [f"{preset}: {''.join(report)}" for report in reports]
        run.note(f"{preset}: {len(found)} groups of tests, {len(reports)} reports")
        if done.returncode and not wrong:
            wrong.append((done.stdout + done.stderr).strip()[-500:])
        for line in wrong:
            run.fail(line)
