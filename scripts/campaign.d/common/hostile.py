"""Cases of hostile files, and the judgement of what the program made of them."""
import hashlib
import shutil
import subprocess
from dataclasses import dataclass, field

from . import watched
from .programme import TIND

# Verdicts. "refused": an honest error, no finished tiles. "same": the tiles of the sound file. "bounded": either, or
# tiles of what the file now says; it must end, and open nothing else. "sound": refused, or the same, or the tiles of
# what GDAL's own tool reads of it without an error: no other heights.
VERDICTS = ("refused", "same", "sound", "bounded")
HONEST = {2, 65, 69, 73, 74, 75}  # server/cli/program/exit.h; 1 would be a mistake of the program itself
PEAK_MB, CPU_S = 512, 60


@dataclass
class Case:
    name: str
    files: dict                      # name: bytes, or text with {dir} and {far}, or what makes one; the first is built
    verdict: str
    args: list = field(default_factory=lambda: ["{0}"])  # {0}: the first file; {dir}: the folder; {far}: one beside it
    like: str = "small"              # the reference whose tiles are the right ones
    env: dict = field(default_factory=dict)
    far: dict = field(default_factory=dict)  # files in the folder beside it, which must not be opened

    def __str__(self):
        return self.name


def tiles(folder):
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
            for p in folder.rglob("*.terrain")} if folder.exists() else {}


def build(args, where, env=None, watch=True):
    return watched.run([TIND, "build", *args, "-o", where / "tiles", "--threads", "1", "--effort", "fast", "--progress",
                        "none"], where, 4096, CPU_S, env, watch)


class Judge:
    def __init__(self, run, common):
        self.run, self.common, self.references, self.peak, self.cpu, self.built = run, common, {}, 0, 0, 0
        self.shared = ()  # further files that may be opened

    def reference(self, name, source, args=()):
        """Tiles of a sound file, made without being watched."""
        where = self.run.work / f"reference-{name}"
        where.mkdir()
        seen = build([source, *self.common.get(name, []), *args], where, watch=False)
        self.references[name] = tiles(where / "tiles")
        if seen.code != 0 or not self.references[name]:
            self.run.fail(f"the sound file {name}: {seen.code} {seen.err.strip()}")

    def try_case(self, case):
        place, far = self.run.work / "case", self.run.work / "far"
        out = self.run.work / "out"
        for folder in (place, far, out):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        for folder, files in ((place, case.files), (far, case.far)):
            for name, data in files.items():
                data = data() if callable(data) else data
                (folder / name).write_bytes(fill(data, place, far) if isinstance(data, str) else data)
        first = place / next(iter(case.files), "none")
        args = [str(a).replace("{0}", str(first)).replace("{dir}", str(place)).replace("{far}", str(far))
                for a in case.args]
        before = {p: p.read_bytes() for p in [*place.iterdir(), *far.iterdir()]}
        seen = build(args + self.common.get(case.like, []), out, environment(case.env))
        self.run.executions += 1
        self.peak, self.cpu = max(self.peak, seen.peak_mb), max(self.cpu, seen.cpu_s)
        self.built += seen.code == 0
        wrong = self.judge(case, seen, first, out, (str(place), str(out), *self.shared))
        if {p: p.read_bytes() for p in [*place.iterdir(), *far.iterdir()]} != before:
            wrong.append("files of the source were changed")
        for what in wrong:
            self.run.fail(f"{case.name}: {what}")
        return seen

    def judge(self, case, seen, first, out, allowed):
        wrong = [f"opened {call}" for call in seen.foreign(allowed)]
        if seen.hung or seen.cpu_s > CPU_S:
            wrong.append(f"took {seen.cpu_s:.0f} s of CPU")
        if seen.peak_mb > PEAK_MB:
            wrong.append(f"took {seen.peak_mb:.0f} MB")
        made, right = tiles(out / "tiles"), self.references.get(case.like, {})
        if seen.code == 0 and case.verdict == "refused":
            wrong.append("was not refused")
        if seen.code != 0:
            if seen.code not in HONEST:
                wrong.append(f"ended with {seen.code}")
            if "tind: " not in seen.err:
                wrong.append(f"ended with {seen.code} and said {seen.err.strip()[:80]!r}")
            if (out / "tiles/layer.json").exists():
                wrong.append("was refused, and there is a layer.json")
            if case.verdict == "same":
                wrong.append(f"was refused: {seen.err.strip()[:200]}")
        elif case.verdict in ("same", "sound") and made != right:
            if case.verdict == "same" or made != self.as_gdal_reads(case, first):
                wrong.append("has other tiles than the sound file" + (" and GDAL" if case.verdict == "sound" else ""))
        return wrong

    def as_gdal_reads(self, case, first):
        """The tiles of a plain copy of it, or nothing where GDAL's own tool finds an error."""
        where = self.run.work / "gdal"
        shutil.rmtree(where, ignore_errors=True)
        where.mkdir()
        copy = where / "copy.tif"
        done = subprocess.run(["gdal_translate", "-q", "-strict", "-of", "GTiff", "--config", "GDAL_PAM_ENABLED", "NO",
                               "--config", "DTED_VERIFY_CHECKSUM", "YES", str(first), str(copy)],
                              capture_output=True, text=True, timeout=120)
        if done.returncode != 0 or "ERROR" in done.stderr:
            return None
        args = [str(copy) if a == "{0}" else a for a in case.args]
        return tiles(where / "tiles") if build(args + self.common.get(case.like, []), where, watch=False).code == 0 else None


def fill(text, place, far):
    return text.replace("{dir}", str(place)).replace("{far}", str(far)).encode()


def environment(more):
    import os
    return {**os.environ, **more} if more else None
