"""Every N-th system call fails: of builds of every kind, of updates, a copy, shards, of analyses, and of the daemon from its start to its end."""
import collections
import re

from common import figures, programme
from common.analyses import analyses
from common.batches import batches
from common.hostile import HONEST
from common.daemon_life import DaemonLife, judge, what_is_wrong
from common.work import difference, works

TIERS = ("ci", "gate", "campaign")
DAEMON = 4  # shares of the time that a work has one of: a life of it is long
ASKED = "D2, D4: every N of each call x {EIO, ENOSPC, EMFILE, EINTR, ...}, 3,000 points; no false success; run again, same bytes"
WHY_NOT = ("as many points as the seconds allow, some in a thousand of those that there are, others with each seed: all of them would take days; linkat and "
           "unlinkat fail after seed 81 only; EAGAIN is for clone3 and getrandom alone; calls on sockets and pipes do not fail; a GeoPackage's words for its CRS "
           "lack codes where PROJ's database fails just as GDAL writes them: the same CRS, other bytes")

ERRORS = {"openat": ("EIO", "EMFILE", "EINTR", "EACCES"), "read": ("EIO", "EINTR"), "pread64": ("EIO", "EINTR"), "write": ("EIO", "ENOSPC", "EINTR", "EDQUOT"),
          "pwrite64": ("EIO", "ENOSPC"), "fsync": ("EIO", "ENOSPC"), "fdatasync": ("EIO",), "syncfs": ("EIO",), "rename": ("EIO", "ENOSPC"),
          "renameat2": ("EIO",), "close": ("EIO", "EINTR"), "mkdir": ("EIO", "ENOSPC"), "unlink": ("EIO",), "unlinkat": ("EIO",),
          "linkat": ("EIO", "ENOSPC"), "ftruncate": ("EIO", "ENOSPC"),
          "mmap": ("ENOMEM",), "fstat": ("EIO",), "newfstatat": ("EIO",), "lseek": ("EIO",), "getdents64": ("EIO",), "fcntl": ("EINTR", "ENOLCK"),
          "flock": ("EINTR",), "clone3": ("EAGAIN",), "getrandom": ("EAGAIN",)}
SYNCS = ("fsync", "fdatasync", "syncfs")


def REACHED(rows):
    last = figures.last_whole(rows)
    return {"D2": f"faults: {sum(row.tried for row in rows):,} points tried of builds, analyses and the daemon (there are "
                  f"{sum(n for n, in figures.numbers(r' of ([0-9,]+) points', [last])):,} by the last row, {last.wrong} wrong in it)"}


def strace(trace, point=None):
    """Of all these calls; where one is to fail, of that call alone: the others then run at their full speed."""
    calls, inject = (*ERRORS, "munmap"), ()
    if point:
        _, call, error, n, more = point
        calls, inject = (call,), ("--seccomp-bpf", "-e", f"inject={call}:error={error}:when={n}{more}")
    return ["strace", "-f", "-qq", "-y", "-e", "signal=none", "-e", "trace=" + ",".join("?" + c for c in calls), *inject, "-o", str(trace)]


def counts(trace):
    """Which of each call are the program's own, of the thread that makes most: strace counts for each thread alone. Those
    of the loader, which is not ours, come before: it unmaps its cache when all libraries are in their places."""
    text = trace.read_text(errors="replace")
    cache = re.search(r"ld\.so\.cache>, 0\) = (0x\w+)", text)
    unmapped = text.find(f"munmap({cache[1]},") if cache else -1
    loaders, found = collections.Counter(), {}
    for match in re.finditer(r"^(\d+) +(\w+)\(", text, re.M):
        pid, call = match.groups()
        if match.start() < unmapped:
            loaders[call] += 1
        found.setdefault(call, collections.Counter())[pid] += 1
    return {call: range(loaders[call] + 1, max(by.values()) + 1) for call, by in found.items()}


def points(name, found, persistent):
    """`+`: that call and all that follow. An interrupted call is made again, and no system interrupts for ever."""
    return [(name, call, error, n, more) for call, errors in ERRORS.items() for error in errors for n in found.get(call, ())
            for more in (("", "+") if persistent and error != "EINTR" else ("",))]


def loader(text):
    return "while loading shared libraries" in text or "cannot apply additional memory protection" in text or "ld.so" in text


def fault(work, point):
    call = point[1]
    folder = work.place("fault")
    done = work.ran(folder, strace(folder / "trace", point))
    if done is None:
        return "does not end"
    struck = "(INJECTED)" in (folder / "trace").read_text(errors="replace")
    (folder / "trace").unlink()
    if loader(done.stderr):
        return ""
    if done.returncode == 0:
        if call in SYNCS and struck and "not supported" not in done.stderr:
            return "a sync failed, and the exit code is 0"
        return difference(work.result(folder), work.wanted)
    if done.returncode not in HONEST:
        return f"ended with {done.returncode}: {done.stderr.strip()[-200:]}"
    if "tind: " not in done.stderr and call != "write" and not work.said(folder):
        return f"ended with {done.returncode} and said nothing"
    return work.again(folder)


def only_in_files(trace):
    """Was a file struck? Pipes, sockets and the kernel's own handles do not fail like that."""
    struck = [line for line in trace.read_text(errors="replace").splitlines() if "(INJECTED)" in line]
    return not any("<pipe:" in line or "<socket:" in line or "anon_inode" in line for line in struck)


def daemon_faults(run, share):
    life, trace = DaemonLife(run), run.work / "trace"
    right = life.live(strace(trace))
    if wrong := what_is_wrong(right):
        run.fail(f"daemon: {wrong}")
        return
    every = points("daemon", counts(trace), False)
    done = 0
    for point in run.sample(every, share):
        if run.time_left() < 0:
            break
        got = life.live(strace(trace, point))
        why = judge(right, got, loader) if only_in_files(trace) else ""
        if why:
            run.fail(f"{' '.join(map(str, point))}: {why}")
        run.executions += 1
        done += 1
    run.note(f"daemon {done:,} of {len(every):,} points")


def run(run):
    programme.needs("strace")
    todo = [*works(run), *analyses(run), *batches(run)]
    for work in todo:
        folder = work.place("trace")
        work.ran(folder, strace(folder / "trace"))
        every = points(work.name, counts(folder / "trace"), run.tier != "ci")
        done = 0
        limit = run.time_left() / (len(todo) + DAEMON - todo.index(work))
        end = run.time_left() - limit
        for point in run.sample(every, 0.02):
            if run.time_left() < end:
                break
            why = fault(work, point)
            run.executions += 1
            done += 1
            if why:
                run.fail(f"{' '.join(map(str, point))}: {why}")
        run.note(f"{work.name} {done:,} of {len(every):,} points")
    daemon_faults(run, 0.02)
