"""Reads and writes of files and connections do half of what was asked for, every one of them or every N-th."""
import json
import os
import subprocess

from common import figures, programme
from common.analyses import analyses
from common.batches import batches
from common.daemon import Daemon
from common.tiff import tiff
from common.work import difference, heights, works

TIERS = ("ci", "gate", "campaign")
ASKED = "D2, for short counts: right bytes whatever the system takes or gives at a time"
WHY_NOT = "calls of the C library inside itself (fread, fwrite) are not shortened; messages of the sandbox have borders and are whole"

PATHS = ["/terrain/dem/layer.json", "/terrain/dem/0/1/0.terrain", "/terrain/dem/5/33/24.terrain", "/elevation/dem?lon=8.02&lat=46.98",
         "/terrain/built/0/1/0.terrain", "/terrain/built/layer.json", "/openapi.json"]


def REACHED(rows):
    calls = figures.numbers(r"([\d,]+) calls of (\d+) commands shortened", rows)
    return {"D2": f"shorts: {sum(row.tried for row in rows):,} runs, {calls[-1][0]:,} calls of {calls[-1][1]} commands shortened in the last row, {rows[-1].wrong} wrong in it"}


def library(run):
    programme.needs("g++")
    made = run.work / "short_io.so"
    subprocess.run(["g++", "-std=c++20", "-O1", "-shared", "-fPIC", "-o", str(made), str(programme.ROOT / "tests/support/short_io.cc")], check=True)
    return made


def serve(run, dem, built, **env):
    """Answers, and how the daemon ended."""
    with Daemon("--threads", "1", "--build-threads", "1", dems=(f"dem={dem}", f"built={built}"), env={**os.environ, **env}) as daemon:
        if not daemon.url:
            return None, "".join(daemon.log)[-300:]
        answers = [daemon.get(path) for path in PATHS for _ in range(2)]
        answers.append(json.loads(daemon.get("/datasets"))["datasets"][0]["name"])
        return answers, daemon.stop()


def run(run):
    short = library(run)
    todo = [*works(run), *analyses(run), *batches(run)]
    steps = (1, 2, 3, 7) if run.tier == "ci" else range(1, 60)
    shortened = 0
    for work in todo:
        for every in steps:
            folder, log = work.place("short"), run.work / "shortened"
            done = work.ran(folder, env={"LD_PRELOAD": str(short), "SHORT_EVERY": str(every), "SHORT_LOG": str(log)})
            run.executions += 1
            if done is None:
                run.fail(f"{work.name}, every {every}: does not end")
                continue
            shortened += int(log.read_text())
            why = done.stderr.strip()[-200:] if done.returncode else difference(work.result(folder), work.wanted)
            if why:
                run.fail(f"{work.name}, every {every}: {done.returncode} {why}")
    dem, built = run.work / "dem.tif", run.work / "build-wanted/out"
    dem.write_bytes(tiff(heights(), compress=8))
    right, code = serve(run, dem, built)
    if code != 0:
        run.fail(f"daemon: {code} without a short count")
    for every in steps:
        got, code = serve(run, dem, built, LD_PRELOAD=str(short), SHORT_EVERY=str(every))
        run.executions += 1
        if code != 0 or got != right:
            run.fail(f"daemon, every {every}: {code}, {[PATHS[i // 2] for i, (a, b) in enumerate(zip(got or [], right)) if a != b][:4]}")
    run.note(f"{shortened:,} calls of {len(todo)} commands shortened, and those of a daemon")
