"""What is attacked beside builds of tiles: images, scenery, CDB, 3D Tiles, and a build in shards. The DEM is projected and
above a geoid, so that PROJ's tables are read, too."""
import re

from .programme import TIND
from .tiff import place, tiff
from .work import OPTIONS, Work, heights

QUIET = ["--threads", "1", "--progress", "none"]
DATUM = ["--from-datum", "egm96"]
UTM_32 = [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 25832]
# Of who was killed or could not remove it: merge and the next run remove what nobody touched for ten minutes.
LEFT_IN_SHARDS = re.compile(r"out/shards/.*(\.beat|\.tiles|\.tind-part|-\d+\.pmtiles)$")


def folders(run, before, after):
    """Each kind of output made anew, and in place of that of another DEM."""
    levels = ["--levels", "0-9"]
    kinds = {"images": lambda dem, out: [TIND, "build", dem, "-o", out, "--format", "rgb", *levels, *DATUM, *QUIET],
             "flightgear": lambda dem, out: [TIND, "build", dem, "-o", out, "--format", "flightgear", *DATUM, *OPTIONS],
             "3dtiles": lambda dem, out: [TIND, "build", dem, "-o", out, "--format", "3dtiles", "--archive", out.with_suffix(".3tz"), *levels, *DATUM,
                                       *OPTIONS],
             "cdb": lambda dem, out: [TIND, "export", dem, "-o", out, "--format", "cdb", "--lod", "-2", *DATUM, *QUIET]}
    for name, words in kinds.items():
        first = Work(run, name, lambda out, words=words: words(before, out))
        old = first.prepare()
        yield first
        if name != "cdb":  # has no --force: it never replaces another's
            force = [] if name == "3dtiles" else ["--force"]
            over = Work(run, f"{name}-over", lambda out, words=words, force=force: [*words(after, out), *force], start=old)
            over.prepare()
            yield over


def shards(run, dem):
    """A plan, one of its shards, and what is made of them all."""
    empty = run.work / "empty"
    empty.mkdir()

    def work(name, words, start):
        return Work(run, name, lambda out: [str(word).replace("OUT", str(out)) for word in words], start=start, left=LEFT_IN_SHARDS)

    plan = work("plan", [TIND, "plan-build", dem, "-o", "OUT/plan.json", "--shards", "2", "--max-error", "20", *DATUM, *OPTIONS], empty)
    made, each = plan.prepare(), {}
    for which in ("0/2", "1/2", "top"):
        each[which] = work("shard-" + which[0], [TIND, "build", "--plan", "OUT/plan.json", "--shard", which, *QUIET], made)
        made = each[which].prepare()
    merges = [work(name, [TIND, "merge", "--plan", "OUT/plan.json", "-o", "OUT/" + file, *QUIET], made)
              for name, file in (("merge", "tiles"), ("merge-archive", "tiles.pmtiles"))]
    for merge in merges:
        merge.prepare()
    return [plan, each["1/2"], *merges]


def batches(run):
    before, after = run.work / "batches-before.tif", run.work / "batches-after.tif"
    for dem, raised in ((before, 0), (after, 300)):
        dem.write_bytes(tiff(heights(raised), compress=8, at=place(424000, 5205000, 90, UTM_32)))
    return [*folders(run, before, after), *shards(run, before)]
