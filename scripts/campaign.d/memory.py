"""Every N-th allocation of the program's own code fails (std::bad_alloc), by a library in front of it."""
import subprocess

from common import figures, programme
from common.analyses import analyses
from common.batches import batches
from common.hostile import HONEST
from common.daemon_life import DaemonLife, judge, what_is_wrong
from common.work import difference, works

TIERS = ("ci", "gate", "campaign")
DAEMON = 4  # shares of the time that a work has one of: a life of it is long
ASKED = "D1: every N of start-up, tiles, reload, a batch: right bytes or an honest end; never an abort, never other bytes"
WHY_NOT = ("as many points as the seconds allow, one in some ten thousand, others with each seed; one allocation fails, not all that follow; allocations inside GDAL and PROJ are not failed: both abort by design; "
           "nlohmann-json 3.11.2 crashes where the allocation fails by which operator[] makes an object of a null value")


def REACHED(rows):
    last = figures.last_whole(rows)
    return {"D1": f"{sum(row.tried for row in rows):,} points tried (there are {sum(n for n, in figures.numbers(r' of ([0-9,]+) points', [last])):,} by the last row, "
                  f"{last.wrong} wrong in it)"}


def failing_new(run):
    programme.needs("g++")
    source, library = programme.ROOT / "tests/support/failing_new.cc", run.work / "failing_new.so"
    subprocess.run(["g++", "-std=c++17", "-O1", "-shared", "-fPIC", "-o", str(library), str(source)], check=True)
    return library


def attempt(work, library, **variables):
    folder = work.place("alloc")
    done = work.ran(folder, env={"LD_PRELOAD": str(library), **variables})
    if done is None:
        return "does not end", folder
    if done.returncode == 0:
        return difference(work.result(folder), work.wanted), folder
    if done.returncode not in HONEST:
        return f"ended with {done.returncode}: {done.stderr.strip()[-200:]}", folder
    if "tind: " not in done.stderr:
        return f"ended with {done.returncode} and said nothing", folder
    return "", folder


def daemon_without(run, library, share):
    """The daemon's own, and those of the jobs that it starts."""
    life, count = DaemonLife(run), run.work / "count"
    right = life.live(env={"LD_PRELOAD": str(library), "COUNT_NEW": str(count)})
    if wrong := what_is_wrong(right):
        run.fail(f"daemon: {wrong}")
        return
    every = [("daemon", n) for n in range(1, int(count.read_text()) + 1)]
    done = 0
    for _, n in run.sample(every, share):
        if run.time_left() < 0:
            break
        why = judge(right, life.live(env={"LD_PRELOAD": str(library), "FAIL_NEW": str(n)}))
        if why:
            run.fail(f"daemon, allocation {n}: {why}")
        run.executions += 1
        done += 1
    run.note(f"daemon {done:,} of {len(every):,} points")


def run(run):
    library = failing_new(run)
    todo = [*works(run), *analyses(run), *batches(run)]
    for i, work in enumerate(todo):
        file = run.work / "count"
        why, _ = attempt(work, library, COUNT_NEW=str(file))
        if why:
            run.fail(f"{work.name}: {why} without a fault")
            continue
        every = [(work.name, n) for n in range(1, int(file.read_text()) + 1)]
        end = run.time_left() - run.time_left() / (len(todo) + DAEMON - i)
        done = 0
        for _, n in run.sample(every, 0.01):
            if run.time_left() < end:
                break
            why, folder = attempt(work, library, FAIL_NEW=str(n))
            why = why or work.again(folder)
            run.executions += 1
            done += 1
            if why:
                run.fail(f"{work.name}, allocation {n}: {why}")
        run.note(f"{work.name} {done:,} of {len(every):,} points")
    daemon_without(run, library, 0.01)
