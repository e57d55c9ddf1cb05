"""A disk that is really full: tmpfs of some sizes, then with room again."""
import os
import subprocess

from common import figures, programme
from common.hostile import HONEST
from common.programme import ROOT, TIND
from common.work import difference, files

TIERS = ("ci", "gate", "campaign")
ASKED = "D3: tmpfs of 1, 2, 5, 10, 20 MB: stops with a clear message, goes on when there is room, same bytes"
WHY_NOT = "outputs of builds and copies are of a megabyte, and fit into 2 MB; only meshes of nearly all posts, after seed 81, fill 5, 10 and 20 MB; tmpfs, no other file system"
DEM = ROOT / "testdata/rainier.tif"
LARGE = "simplify hardly anything"
OPTIONS = ["--effort", "fast", "--max-error", "20", "--progress", "none"]
KB = {"ci": [200], "gate": [64, 100, 200, 300, 400, 600, 800, 1000, 2000, 5000], "campaign": list(range(50, 1200, 25))}


# A mesh of 21 MB.
LARGE_KB = {"ci": [], "gate": [1000, 2000, 5000, 10_000, 20_000], "campaign": list(range(1000, 21_000, 1000))}


def REACHED(rows):
    last = figures.last_whole(rows)
    return {"D3": f"{sum(row.tried for row in rows):,} disks, of 64 kB and more; {last.wrong} wrong in the last row"}


def full(run, kb, wanted, words):
    disk = run.work / "disk"
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kb}k", "tind-campaign", disk], check=True)
    try:
        command = [str(w).replace("{}", str(disk)) for w in words]
        first = subprocess.run(command, capture_output=True, text=True)
        run.executions += 1
        if first.returncode not in HONEST | {0}:
            return f"ended with {first.returncode}: {first.stderr.strip()[-200:]}"
        if first.returncode and "tind: " not in first.stderr:
            return "said nothing"
        subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
        if first.returncode:
            again = subprocess.run(command, capture_output=True, text=True)
            if again.returncode:
                return f"with room again: {again.returncode} {again.stderr.strip()[-200:]}"
        return difference(files(disk), wanted)
    finally:
        subprocess.run(["umount", disk], check=True)


def run(run):
    programme.needs("mount")
    if os.geteuid() != 0:
        raise programme.NotHere("it mounts, so it needs root")
    disk = run.work / "disk"
    disk.mkdir()
    tiles = run.work / "tiles"
    kinds = {"build": [TIND, "build", DEM, "-o", "{}/out", *OPTIONS], "copy to PMTiles": [TIND, "copy", tiles, "{}/out.pmtiles", "--progress", "none"],
             "copy to MBTiles": [TIND, "copy", tiles, "{}/out.mbtiles", "--progress", "none"], "simplify": [TIND, "simplify", DEM, "-o", "{}/out.ply", "--max-error", "20"],
             LARGE: [TIND, "simplify", DEM, "-o", "{}/out.obj", "--max-error", "0.01"]}
    subprocess.run([TIND, "build", DEM, "-o", tiles, *OPTIONS], check=True, capture_output=True)
    for name, words in kinds.items():
        room = run.work / "wanted"
        room.mkdir()
        subprocess.run([str(w).replace("{}", str(room)) for w in words], check=True, capture_output=True)
        wanted = files(room)
        for path in sorted(room.rglob("*"), reverse=True):
            path.unlink() if path.is_file() else path.rmdir()
        room.rmdir()
        for kb in (LARGE_KB if name == LARGE else KB)[run.tier]:
            why = full(run, kb, wanted, words)
            if why:
                run.fail(f"{name}, {kb} kB: {why}")
