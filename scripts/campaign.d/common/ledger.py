"""docs/campaigns.md: one row for each part that was run, and above them what all rows come to beside what is asked."""
from .programme import ROOT

LEDGER = ROOT / "docs/campaigns.md"
HEAD = ("date", "commit", "tier", "part", "seed", "seconds", "executions", "result")
BEGIN = """# Campaigns

What attacked tind, when, and what came of it. `scripts/campaign` writes this file: a row for each part that it ran, and
the table above them. A `+` behind a commit means that the sources had changes that were not in it. `executions` are the
cases, fault points, requests or inputs that were tried, `wrong` those that did not end as they must. What went wrong is
mended with a test, or named in the last column, or the part asked for too much and was changed: the log says which.
[security.md](security.md) says what the parts are for.

"""


def rows():
    if not LEDGER.exists():
        return []
    found = []
    for line in LEDGER.read_text().split("## Ledger")[-1].splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if len(cells) == len(HEAD) and cells[0][:2] == "20":
            found.append(cells)
    return found


def table(head, lines):
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, ["---"] * len(head), *lines]) + "\n"


def summary(all_rows, parts):
    lines = []
    for name, part in parts.items():
        mine = [r for r in all_rows if r[3] == name and not r[7].startswith("not run")]
        total = sum(int(r[6].replace(",", "")) for r in mine)
        last = mine[-1] if mine else None
        lines.append([name, part.ASKED, f"{total:,}", f"{last[2]}, {last[7]}" if last else "not run yet", part.WHY_NOT or "-"])
    return table(["part", "asked", "executions so far", "last run", "short of it, and why"], lines)


def add(done, parts):
    line = [done.date, done.commit, done.tier, done.name, str(done.seed), f"{done.seconds:.0f}", f"{done.executions:,}",
            done.result.replace("|", "/")]
    every = rows() + [line]
    LEDGER.write_text(BEGIN + "## Asked and reached\n" + summary(every, parts) + "\n## Ledger\n" + table(HEAD, every))
