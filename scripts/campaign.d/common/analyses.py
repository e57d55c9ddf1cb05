"""What is attacked beside tiles: what an analyst asks of a DEM, meshes and their streams, what is said of tiles, and builds
with lines and polygons. The DEM is that of the batches: projected, and above a geoid."""
import json

from .batches import DATUM, QUIET, UTM_32
from .programme import TIND
from .tiff import place, tiff
from .work import OPTIONS, Work, heights


def ring(west, south, east, north):
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


def geojson(path, kind, *coordinates):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {"name": f"{kind} {i}"}, "geometry": {"type": kind, "coordinates": each}} for i, each in enumerate(coordinates)]}))
    return path


def analyses(run):
    room = run.work / "analyses"
    room.mkdir()
    dem, older = room / "dem.tif", room / "older.tif"
    for path, raised in ((dem, 0), (older, 30)):
        path.write_bytes(tiff(heights(raised), compress=8, at=place(424000, 5205000, 90, UTM_32)))
    areas = geojson(room / "areas.geojson", "Polygon", [ring(8.01, 46.965, 8.02, 46.975)], [ring(8.03, 46.97, 8.05, 46.985)])
    lines = geojson(room / "lines.geojson", "LineString", [[8.01, 46.96], [8.03, 46.98], [8.06, 46.985]])
    places = room / "places.csv"
    places.write_text("name,lon,lat\n" + "".join(f"p{i},{8.01 + i * 0.005},{46.965 + i * 0.002}\n" for i in range(8)))

    def work(name, suffix, *words, printed=False):
        """OUT in `words` is the output, with that suffix."""
        return Work(run, name, lambda out: [TIND, *(str(word).replace("OUT", str(out.with_suffix(suffix))) for word in words)], printed=printed)

    line, eye = "8.01,46.965 8.05,46.985", "8.03,46.975"
    fine, coarse, stream, tiles = room / "fine.ply", room / "coarse.ply", room / "stream.tpm", room / "tiles"
    makers = [work("fine", ".ply", "simplify", dem, "-o", fine, "--max-error", "5", "--frame", "metric", *QUIET),
              work("coarse", ".ply", "simplify", fine, "-o", coarse, "--ratio", "0.5", "--method", "qem", *QUIET),
              work("stream", ".tpm", "progressive", dem, "-o", stream, *QUIET),
              work("tiles", "", "build", dem, "-o", tiles, "--levels", "0-9", *DATUM, *OPTIONS)]
    for maker in makers:
        maker.prepare()

    every = [work("contours", ".gpkg", "contours", dem, "-o", "OUT", "--interval", "50", *DATUM),
             work("band", ".geojson", "contours", dem, "-o", "OUT", "--interval", "100", "--as-band", "--max-error", "5"),
             work("slope", ".tif", "slope", dem, "-o", "OUT", *DATUM),
             work("hillshade", ".asc", "hillshade", dem, "-o", "OUT"),
             work("relief", ".png", "relief", dem, "-o", "OUT"),
             work("viewshed", ".tif", "viewshed", dem, "-o", "OUT", "--from", eye, "--uncertainty", "1", "--threads", "1", *DATUM),
             work("difference", ".tif", "difference", dem, "--less", older, "-o", "OUT"),
             work("statistics", ".csv", "statistics", dem, "--polygons", areas, "--base", "800", *DATUM, printed=True),
             work("volume", "", "volume", dem, "--height", "900", "--area", areas, "--json", *DATUM, printed=True),
             work("elevation", ".csv", "elevation", dem, "--places", places, "-o", "OUT", *DATUM),
             work("elevation-printed", "", "elevation", "--tiles", tiles, "--level", "9", "--places", places, printed=True),
             work("profile", ".covjson", "profile", dem, "--line", line, "-o", "OUT"),
             work("sight", "", "line-of-sight", dem, "--from", eye, "--to", "8.05,46.985", "--json", *DATUM, printed=True),
             work("unreal", ".png", "export", dem, "-o", "OUT", "--format", "unreal", "--size", "127", *DATUM, *QUIET),
             work("unity", ".raw", "export", dem, "-o", "OUT", "--format", "unity", "--size", "65", *QUIET),
             work("refine", ".glb", "refine", dem, "-o", "OUT", "--bbox", "8.02,46.97,8.03,46.98", *QUIET),
             work("landxml", ".xml", "simplify", dem, "-o", "OUT", "--max-error", "20", *DATUM, *QUIET),
             work("ugrid", ".nc", "simplify", dem, "-o", "OUT", "--max-error", "20", *QUIET),
             work("progressive", ".tpm", "progressive", dem, "-o", "OUT", *QUIET),
             work("extract", ".gpkg", "extract", stream, "-o", "OUT", "--triangles", "500"),
             work("between", ".tpm", "between", fine, coarse, "-o", "OUT", "--progress", "none"),
             work("measure", "", "measure", fine, dem, "--json", *QUIET, printed=True),
             work("lines", "", "build", dem, "-o", "OUT", "--levels", "0-9", "--breaklines", lines, "--flatten", areas, "--water", areas, *DATUM, *OPTIONS),
             work("check", "", "check", tiles, "--source", dem, "--json", *DATUM, *QUIET, printed=True),
             work("explain", ".png", "explain", tiles, "9/534/389", "--source", dem, "--png", "OUT", "--json", *DATUM, "--progress", "none", printed=True),
             work("info", "", "info", dem, tiles, fine, areas, stream, "--json", "--progress", "none", printed=True),
             work("verify", "", "verify", tiles, "--json", "--progress", "none", printed=True),
             work("flight", "", "plan", tiles, "--position", "8.0", "46.97", "4000", "--velocity", "60", "10", "0", "--json", printed=True)]
    for each in every:
        each.prepare()
    return every
