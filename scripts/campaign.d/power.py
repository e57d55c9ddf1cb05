"""Power cuts on a real file system (scripts/power_cuts); BuildFolderTest cuts that of a harsher model."""
import os

from common import programme
from common.scripts import run_script

TIERS = ("gate", "campaign")
ASKED = "E3: 10,000 states after a power cut, every committed tile intact"
WHY_NOT = "the states of the model of a disk are those of BuildFolderTest, which ctest runs; LazyFS is not used"


def run(run):
    programme.needs("mkfs.ext4", "mount")
    if os.geteuid() != 0:
        raise programme.NotHere("it mounts, so it needs root")
    run_script(run, ["power_cuts", "testdata/rainier.tif", 50 if run.tier == "gate" else 500], r"^(\d+) power cuts")
