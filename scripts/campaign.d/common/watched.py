"""Runs a program under strace and limits, and says what it opened, what it reached over the network, what it took."""
import os
import re
import resource
import shutil
import signal
import subprocess
from dataclasses import dataclass, field

from .programme import NotHere

CALLS = ("open", "openat", "openat2", "creat", "connect", "execve", "unlink", "unlinkat", "rename", "renameat",
         "renameat2", "mkdir", "mkdirat", "rmdir", "symlink", "symlinkat", "link", "linkat", "truncate", "chmod",
         "fchmodat", "mknod", "mknodat", "bind", "sendto")
# What any program of this kind reads: libraries, PROJ's and GDAL's tables, what the kernel says of itself.
SYSTEM = re.compile(r"/(lib|lib64|usr/lib|usr/lib64|usr/local/lib|usr/share|usr/local/share|etc/ld\.so|proc|sys|dev/(null|"
                    r"urandom|random|shm)|etc/(localtime|gss|ssl|nsswitch|passwd-none)|root/\.(?:cache|local))(?:[/.]|$)")
LONGEST_S = 300  # of the clock: only what hangs takes so long; what is bounded is the time of the CPU


@dataclass
class Seen:
    code: int = 0
    out: str = ""
    err: str = ""
    peak_mb: float = 0
    cpu_s: float = 0
    opened: list = field(default_factory=list)  # (call, path), of calls that succeeded or tried to
    hung: bool = False

    def foreign(self, allowed):
        """Calls to paths outside the allowed folders and the system's, and to the network."""
        found = []
        for call, path in self.opened:
            inside = path.startswith(allowed) or path[:1] not in ("/", ".")  # relative: in the folder it runs in
            if call in ("connect", "bind", "sendto") or not (inside or SYSTEM.match(path)):
                found.append(f"{call} {path}")
        return found


def parse(trace):
    found = []
    for line in trace.splitlines():
        match = re.match(r"(?:\d+ +)?(\w+)\((.*)", line)
        if not match:
            continue
        call, rest = match.groups()
        if call in ("connect", "bind", "sendto"):
            if "AF_INET" in rest or "sun_path" in rest:
                found.append((call, rest[:120]))
            continue
        found += [(call, path) for path in re.findall(r'"((?:[^"\\]|\\.)*)"', rest)[:2 if "rename" in call else 1]]
    return found


def limits(memory_mb, cpu_s):
    def set_them():
        os.setsid()
        resource.setrlimit(resource.RLIMIT_AS, (memory_mb << 20, memory_mb << 20))
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 5))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return set_them


def run(command, folder, memory_mb=4096, cpu_s=60, env=None, watch=True):
    """`folder` is for the trace and the program's own output."""
    if watch and not shutil.which("strace"):
        raise NotHere("strace is not installed")
    trace = folder / "trace"
    words = [str(w) for w in command]
    if watch:
        words = ["strace", "-f", "--seccomp-bpf", "-qq", "-s", "4096", "-e", "signal=none",
                 "-e", "trace=" + ",".join("?" + c for c in CALLS), "-o", str(trace), *words]
    seen = Seen()
    with open(folder / "out", "wb") as out, open(folder / "err", "wb") as err:
        process = subprocess.Popen(words, stdout=out, stderr=err, stdin=subprocess.DEVNULL, cwd=folder, env=env,
                                   preexec_fn=limits(memory_mb, cpu_s))
        seen.hung, used = not ended(process), None
        if seen.hung:
            os.killpg(process.pid, signal.SIGKILL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    seen.code, seen.peak_mb, seen.cpu_s = process.returncode, used.ru_maxrss / 1024, used.ru_utime + used.ru_stime
    seen.out = (folder / "out").read_text(errors="replace")
    seen.err = (folder / "err").read_text(errors="replace")
    if watch:
        seen.opened = parse(trace.read_text(errors="replace"))[1:]  # without the program itself
    return seen


def ended(process):
    """Whether it ends in time; leaves it to be waited for."""
    end = os.pidfd_open(process.pid)
    import select
    ready, _, _ = select.select([end], [], [], LONGEST_S)
    os.close(end)
    return bool(ready)
