"""docs/campaigns.md: what was asked for beside what was reached, the parts, and a row for each that was run."""
import sys
from typing import NamedTuple

from . import figures
from .programme import ROOT

LEDGER = ROOT / "docs/campaigns.md"
HEAD = ("date", "commit", "tier", "part", "seed", "seconds", "executions", "result")
BEGIN = """# Campaigns

What attacked tind, when, and what came of it: first what was asked for and what was reached, then the parts of
`scripts/campaign`, then a row for each time that one of them ran. [security.md](security.md) says what they are for.

**Who wrote what**: the script writes the rows and the tables (`scripts/campaign --tables`: the tables alone). By hand are the
words at the end of some rows, which say what was wrong, that it was mended, or that somebody ended the run; the rows with seed
`-`, which are of `scripts/tidy` by itself; two rows of sanitizers, one with `--only` and that of seed 91; the row of coverage of
one room.

**How to read a row**: a `+` behind a commit means that the sources had changes that were not in it. `executions` are the
cases, fault points, requests or inputs that were tried, `wrong` those that did not end as they must. What went wrong is
mended with a test, or named in a table, or the part asked for too much and was changed: the log says which. Its row stays.

**Once more the same**: a seed says which cases are tried, and in which order. How many of them come to their turn depends on
the seconds and on the machine, and what threads, sockets and the kernel make of them is never quite the same twice.

"""
ASKED = """## Asked and reached
The plan of all tests asked for these figures: A of the build, B of HTTP, C of fuzzing, D of faults and hostile inputs, E of
crashes, F of load, G of security, H of operation. Where a figure is of several rows, it is of all that the ledger has, if
nothing else is said. Shown by: parts, which the next table explains; tests by file or name; scripts.

"""
PARTS = """
## Parts
What each asks for, how much it has tried in all rows, how its last row ended, and what it does not do.

"""


class Row(NamedTuple):
    date: str
    commit: str
    tier: str
    part: str
    seed: str
    seconds: str
    executions: str
    result: str

    @property
    def tried(self):
        return int(self.executions.replace(",", ""))

    @property
    def wrong(self):
        return int(self.result.split(" wrong")[0])


def rows():
    if not LEDGER.exists():
        return []
    found = []
    for line in LEDGER.read_text().split("## Ledger")[-1].splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if len(cells) == len(HEAD) and cells[0][:2] == "20":
            found.append(Row(*cells))
    return found


def of_parts(all_rows, parts):
    """Those that say what was tried."""
    return {name: [row for row in all_rows if row.part == name and not row.result.startswith("not run")] for name in parts}


def table(head, lines):
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, ["---"] * len(head), *lines]) + "\n"


def asked_and_reached(by_part, parts):
    return table(["id", "asked", "shown by", "reached", "short of it, and why"], figures.lines(by_part, parts))


def summary(by_part, parts):
    lines = []
    for name, part in parts.items():
        mine = by_part[name]
        last = mine[-1] if mine else None
        ended = f"{last.date}, {last.commit}, {last.tier}, seed {last.seed}: {last.wrong} wrong" if last else "not run yet"
        lines.append([name, part.ASKED, f"{sum(row.tried for row in mine):,}", ended, part.WHY_NOT or "-"])
    return table(["part", "asked", "executions so far", "last row", "not done, and why"], lines)


def write(every, parts):
    """The rows, and above them what they come to. Whether all that the tables name is there."""
    by_part, gone = of_parts(every, parts), figures.not_there()
    LEDGER.write_text(BEGIN + ASKED + asked_and_reached(by_part, parts) + PARTS + summary(by_part, parts) + "\n## Ledger\n" + table(HEAD, every))
    for name in gone:
        print(f"ledger: the table of figures names {name}, which is not there", file=sys.stderr)
    return not gone


def add(done, parts):
    line = Row(done.date, done.commit, done.tier, done.name, str(done.seed), f"{done.seconds:.0f}", f"{done.executions:,}", done.result.replace("|", "/"))
    write(rows() + [line], parts)
