"""Power cuts on a real file system (scripts/power_cuts); BuildFolderTest cuts that of a harsher model."""
import os

from common import figures, programme
from common.scripts import run_script

TIERS = ("gate", "campaign")
ASKED = "E3: 10,000 states after a power cut, every committed tile intact"
WHY_NOT = ("hundreds of cuts, not 10,000, as after each a build is run again; the states of the harsher model of a disk are those of two tests, BuildFolderTest, 60 random ones each "
           "in every test run; LazyFS is not used; where in a build a cut comes depends on the machine")


def REACHED(rows):
    kept = figures.numbers(r"(\d+) power cuts: (\d+) folders not as wanted.*?, (\d+) tiles kept, (\d+) made again", rows)
    return {"E3": f"{sum(n for n, *_ in kept):,} cuts of an ext4, {sum(bad for _, bad, *_ in kept)} folders not as wanted; {sum(k for *_, k, _ in kept):,} tiles kept, "
                  f"{sum(m for *_, m in kept):,} made again"}


def run(run):
    programme.needs("mkfs.ext4", "mount")
    if os.geteuid() != 0:
        raise programme.NotHere("it mounts, so it needs root")
    run_script(run, ["power_cuts", "testdata/rainier.tif", 50 if run.tier == "gate" else 500, run.seed], r"^(\d+) power cuts")
