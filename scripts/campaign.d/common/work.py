"""What is attacked while it runs: small builds, an update, a copy. Each can be begun again from the same state."""
import os
import shutil
import signal
import subprocess

from .programme import TIND
from .tiff import place, tiff

OPTIONS = ["--effort", "fast", "--threads", "1", "--progress", "none"]


def files(folder):
    """What is in a folder, but for lock and leftovers of the moment."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*"))
            if p.is_file() and p.name != "tind-lock"}  # a lock is of who holds it, not that it lies there


def heights(raised=0):
    return [[int(800 + raised * (x < 20 and y < 20) + 60 * ((x * 5 + y * 3) % 11) + 9 * x) for x in range(60)] for y in range(50)]


class Work:
    """A command whose output is a folder or a file, called `out` below a place of its own, and what it prints."""

    def __init__(self, run, name, command, start=None, left=None, printed=False):
        """`left`: names of what may be left over, a pattern. `printed`: what it prints is a result, too."""
        self.run, self.name, self.make, self.start, self.left, self.printed = run, name, command, start, left, printed
        self.wanted = None

    def place(self, name):
        folder = self.run.work / f"{self.name}-{name}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        if self.start:
            shutil.copytree(self.start, folder / "out")
        return folder

    def command(self, folder):
        return [str(c) for c in self.make(folder / "out")]

    def ran(self, folder, prefix=(), env=None, seconds=300):
        """What has come of it; nothing where it took longer, and was killed with all that it had begun."""
        with open(folder / ("out.printed" if self.printed else "said"), "wb") as out:
            process = subprocess.Popen([*prefix, *self.command(folder)], stdout=out, stderr=subprocess.PIPE, text=True, errors="replace",
                                       env={**os.environ, **(env or {})}, start_new_session=True)
            try:
                _, said = process.communicate(timeout=seconds)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
                return None
        return subprocess.CompletedProcess(process.args, process.returncode, None, said)

    def result(self, folder):
        """All that it wrote: `out`, or files beside it called the same (out.pmtiles)."""
        return {name: content for name, content in files(folder).items()
                if name.startswith("out") and not (self.left and self.left.match(name))}

    def said(self, folder):
        """Has it printed a report, which says what is wrong?"""
        return self.printed and (folder / "out.printed").stat().st_size > 0

    def prepare(self):
        folder = self.place("wanted")
        done = self.ran(folder)
        if done is None or done.returncode:
            raise RuntimeError(f"{self.name}: {done.stderr if done else 'does not end'}")
        self.wanted = self.result(folder)
        return folder / "out"

    def again(self, folder):
        """What is wrong after the same command, undisturbed: nothing, or a text."""
        done = self.ran(folder)
        if done is None:
            return "run again: does not end"
        if done.returncode:
            return f"run again: {done.returncode} {done.stderr.strip()[:200]}"
        return difference(self.result(folder), self.wanted)


def difference(now, wanted):
    names = [n for n in sorted(now.keys() | wanted.keys()) if now.get(n) != wanted.get(n)]
    return "not as wanted: " + ", ".join(names[:5]) if names else ""


def works(run):
    """A first build, an update of it, one of a DEM that lost what some tiles were of, a copy into an archive, and a mesh;
    of a DEM of 60 x 50 posts."""
    before, after = run.work / "before", run.work / "after"
    for folder, raised in ((before, 0), (after, 300)):
        folder.mkdir()
        (folder / "dem.tif").write_bytes(tiff(heights(raised), compress=8))
    levels = ["--levels", "0-9"]
    build = Work(run, "build", lambda out: [TIND, "build", before / "dem.tif", "-o", out, *levels, *OPTIONS])
    old = build.prepare()
    update = Work(run, "update", lambda out: [TIND, "build", after / "dem.tif", "-o", out, *levels, *OPTIONS], start=old)
    update.prepare()
    border = place(8.07, 47.0, 1 / 1200)  # tiles of level 9 have a side at 8.0859
    for name, columns in (("wide", 60), ("narrow", 15)):
        (run.work / f"{name}.tif").write_bytes(tiff([row[:columns] for row in heights()], compress=8, at=border))
    wide = Work(run, "wide", lambda out: [TIND, "build", run.work / "wide.tif", "-o", out, *levels, *OPTIONS])
    shrink = Work(run, "shrink", lambda out: [TIND, "build", run.work / "narrow.tif", "-o", out, *levels, *OPTIONS], start=wide.prepare())
    shrink.prepare()
    if len([name for name in shrink.wanted if name.endswith(".terrain")]) >= len([name for name in wide.wanted if name.endswith(".terrain")]):
        raise RuntimeError("shrink: as many tiles as before")
    copy = Work(run, "copy", lambda out: [TIND, "copy", old, out.with_suffix(".pmtiles"), "--progress", "none"])
    copy.prepare()
    mesh = Work(run, "simplify", lambda out: [TIND, "simplify", before / "dem.tif", "-o", out.with_suffix(".ply"), "--ratio", "0.3",
                                              "--threads", "1"])
    mesh.prepare()
    return [build, update, shrink, copy, mesh]
