"""What every part is given: its tier, its random numbers, its time, a folder; and what it hands back."""
import datetime
import os
import random
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

os.environ.setdefault("TIND_AS_ROOT", "true")  # at work here alone, maybe where there is no other user
ROOT = Path(__file__).resolve().parents[3]
TIND = Path(os.environ.get("TIND_BINARY", ROOT / "build/release/tind"))
SECONDS = {"ci": 60, "gate": 900, "campaign": 3600}  # where the part has none of its own


class NotHere(Exception):
    """Something that a part needs is missing on this machine."""


def needs(*programs):
    for program in programs:
        if not shutil.which(program):
            raise NotHere(f"{program} is not installed (scripts/setup campaign)")


class Run:
    """One part, once. `executions` counts what was tried, `wrong` what was not as it must be."""

    def __init__(self, name, asked, work, part=None):
        self.name, self.tier, self.seed, self.only = name, asked.tier, asked.seed, asked.only or ""
        self.seconds = asked.seconds or getattr(part, "SECONDS", {}).get(asked.tier, SECONDS[asked.tier])
        self.rng = random.Random(f"{name} {asked.seed}")
        self.work = Path(work).resolve()
        self.executions, self.wrong, self.notes = 0, [], []
        self.begin = time.monotonic()

    def time_left(self):
        return self.begin + self.seconds - time.monotonic()

    def fail(self, what):
        self.wrong.append(what)
        print(f"  WRONG {what}", flush=True)

    def note(self, what):
        """A figure for the ledger."""
        self.notes.append(what)

    def sample(self, cases, share):
        """In ci a share, by the seed, else all. In an order of the seed, so that time cuts fairly where it is too short for all."""
        cases = [c for c in cases if self.only in str(c)]
        self.rng.shuffle(cases)
        return cases if self.tier != "ci" or self.only else cases[:max(1, int(len(cases) * share))]


class Done:
    def __init__(self, run, missing):
        self.name, self.tier, self.seed, self.executions = run.name, run.tier, run.seed, run.executions
        self.seconds = time.monotonic() - run.begin
        self.date = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
        self.commit = commit()
        self.failed = bool(run.wrong)
        if missing:
            self.result = f"not run: {missing}"
        else:
            self.result = f"{len(run.wrong)} wrong" + "".join("; " + n for n in run.notes)


def commit():
    def git(*words):
        return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True).stdout.strip()
    changed = git("status", "--porcelain", "--untracked-files=no", "--", "server", "terrain", "proto", "CMakeLists.txt")
    return git("rev-parse", "--short", "HEAD") + ("+" if changed else "")


def run(part, name, asked):
    print(f"=== {name} ({asked.tier}, seed {asked.seed})", flush=True)
    with tempfile.TemporaryDirectory(prefix="tind-campaign-") as work:
        it, missing = Run(name, asked, work, part), ""
        try:
            part.run(it)
            if it.executions == 0 and not it.wrong:
                it.fail("nothing was tried")
        except NotHere as why:
            missing = str(why)
        done = Done(it, missing)
    print(f"{name}: {done.executions} executions in {done.seconds:.0f} s: {done.result}", flush=True)
    return done
