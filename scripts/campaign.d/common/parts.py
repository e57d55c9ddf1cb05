"""The parts: every file of scripts/campaign.d. A part has TIERS, ASKED (the figure that is wanted of it, and the words
of the programme that it comes from), WHY_NOT (what of it is not done, and why) and run(Run). It may have SECONDS (by
tier, where that is not what the others have) and REACHED(rows): what all its rows of the ledger say, by id of the
programme (figures.py)."""
import importlib.util
from pathlib import Path

ORDER = ["rasters", "vectors", "http", "garden", "faults", "space", "memory", "kills", "jobs", "power", "fuzz", "load",
         "reloads", "mutants"]


def module(path):
    spec = importlib.util.spec_from_file_location(f"part_{path.stem}", path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def load():
    paths = {p.stem: p for p in Path(__file__).resolve().parent.parent.glob("*.py")}
    names = sorted(paths, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))
    return {name: module(paths[name]) for name in names}
