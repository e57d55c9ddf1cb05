#!/usr/bin/python3
"""Heightmaps of `tind export`, read by GDAL and numpy as the engines read them, against the DEM.

    heightmaps.py      with the program in $TIND_BINARY

Unreal: a height is (value - 32768) / 128 of the landscape's Z scale in centimetres, above its location.
Unity: value / 65536 of the terrain's height, above its position; the first row of the file is z = 0, the
south. CDB: posts at the corners of the grid, whose places follow from the file's name alone. Each at
10,000 places within half a step of what lies there between the DEM's posts.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SKIPPED = 77
try:
    import numpy as np
    from osgeo import gdal, osr
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)

from figure import figure
from web_map import Grid, between

gdal.UseExceptions()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEM = ROOT / "testdata/bigtujunga_crop.tif"  # UTM zone 11
PLACES = 10000
TIND = os.environ["TIND_BINARY"]
NAME = re.compile(r"Tiles/([NS]\d\d)/([EW]\d\d\d)/001_Elevation/(LC|L\d\d)/(U\d+)/"
                  r"\1\2_D001_S001_T001_(LC?\d\d)_\4_R(\d+)\.tif$")


def export(*options):
    subprocess.run([TIND, "export", DEM, *map(str, options), "--progress", "none"], check=True, stdout=subprocess.DEVNULL)


def raster(srs_text):
    srs = osr.SpatialReference()
    srs.SetFromUserInput(srs_text)
    srs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return srs


def wanted_at(lon, lat):
    col, row, _ = Grid(DEM).places(lon, lat)
    return between(gdal.Open(str(DEM)).ReadAsArray().astype(float), col, row)


def compare(what, report, metres):
    """`metres`: rows from the north, as the engine has them; some chosen at random."""
    random = np.random.default_rng(3)
    col, row = random.integers(0, report["cols"], 2 * PLACES), random.integers(0, report["rows"], 2 * PLACES)
    x0, y0 = report["place"]["north_west_post"]
    to_globe = osr.CoordinateTransformation(raster(report["place"]["crs"]), raster("EPSG:4326"))
    at = np.stack([x0 + col * report["spacing_m"], y0 - row * report["spacing_m"]], 1)
    lon, lat = np.array(to_globe.TransformPoints(at))[:, :2].T
    wanted = wanted_at(lon, lat)
    away = np.abs(metres[row, col] - wanted)[np.isfinite(wanted)][:PLACES]
    step = report["step_m"]
    figure(f"GDAL {gdal.__version__}", f"{what}: {len(away)} of {report['cols']} x {report['rows']} posts at most {away.max():.5f} m off the DEM, half a step is {step / 2:.5f} m")
    # Beside half a step: float32, and what the places of two programs differ by.
    assert len(away) == PLACES and away.max() <= step / 2 + 1e-3, (what, away.max())
    assert away.max() - 1e-3 <= report["max_quantisation_error_m"] <= step / 2 + 1e-3  # float32 is in it


def unreal(folder):
    for name, more in (("a.png", []), ("a.r16", ["--size", "1009x505", "--to-crs", "EPSG:32611"])):
        export("--format", "unreal", "--fit", "inside", "-o", folder / name, *more)
        report = json.loads((folder / f"{name}.json").read_text())
        shape = report["rows"], report["cols"]
        if name.endswith("png"):
            picture = gdal.Open(str(folder / name))
            assert (picture.RasterYSize, picture.RasterXSize) == shape
            assert picture.GetRasterBand(1).DataType == gdal.GDT_UInt16 and picture.RasterCount == 1
            values = picture.ReadAsArray()
        else:
            values = np.fromfile(folder / name, "<u2").reshape(shape)
        landscape = report["unreal"]
        assert landscape["scale_x"] == landscape["scale_y"] == 100 * report["spacing_m"]
        metres = ((values.astype(float) - 32768) / 128 * landscape["scale_z"] + landscape["location_z_cm"]) / 100
        compare(f"unreal {name}", report, metres)


def unity(folder):
    for order, kind in (("little", "<u2"), ("big", ">u2")):
        file = folder / f"{order}.raw"
        export("--format", "unity", "--fit", "inside", "--byte-order", order, "-o", file)
        report = json.loads((folder / f"{order}.raw.json").read_text())
        values = np.fromfile(file, kind).reshape(report["rows"], report["cols"])
        terrain = report["unity"]
        assert terrain["terrain_width"] == terrain["terrain_length"] == report["world_size_m"][0]
        z_is_south_first = values / 65536 * terrain["terrain_height"] + terrain["position_y"]
        compare(f"unity, bytes {order}", report, z_is_south_first[::-1])
    export("--format", "unity", "--fit", "inside", "--first-row", "north", "-o", folder / "north.raw")
    south = np.fromfile(folder / "little.raw", "<u2").reshape(values.shape)
    assert (np.fromfile(folder / "north.raw", "<u2").reshape(values.shape)[::-1] == south).all()


def cdb(folder):
    """Heights are above what the DEM's are here, so that they can be compared with it."""
    export("--format", "cdb", "--to-datum", "same", "-o", folder / "cdb")
    levels, away = set(), []
    for file in sorted((folder / "cdb").rglob("*.tif")):
        parts = NAME.search(file.as_posix())
        assert parts, file
        lat, lon = (int(p[1:]) * (-1 if p[0] in "SW" else 1) for p in parts.group(1, 2))
        up, lod, right = int(parts.group(4)[1:]), int(parts.group(5).replace("LC", "-").replace("L", "")), int(parts.group(6))
        assert parts.group(3) == ("LC" if lod < 0 else f"L{lod:02}")
        levels.add(lod)
        tile = gdal.Open(str(file))
        side = 1024 if lod >= 0 else 1024 >> -lod
        assert (tile.RasterXSize, tile.RasterYSize) == (side, side) and tile.GetRasterBand(1).DataType == gdal.GDT_Float32
        share = .5 ** max(lod, 0)  # all of this DEM lies between 50 degrees north and south
        step, west, south = share / side, lon + right * share, lat + up * share
        x0, dx, _, y0, _, dy = tile.GetGeoTransform()
        centres = x0 + dx / 2, y0 + dy / 2
        assert np.allclose(centres, (west, south + (side - 1) * step), atol=1e-9) and np.allclose((dx, -dy), step)
        heights = tile.ReadAsArray()
        assert np.isfinite(heights).all()
        if lod == max(levels) and lod > 0:
            c, r = np.meshgrid(np.arange(side), np.arange(side))
            wanted = wanted_at(west + c.ravel() * step, south + (side - 1 - r.ravel()) * step)
            away.append((lod, np.abs(heights.ravel() - wanted)[np.isfinite(wanted)]))
    away = np.concatenate([a for lod, a in away if lod == max(levels)])
    chosen = np.random.default_rng(5).choice(away, PLACES, replace=False)
    figure(f"GDAL {gdal.__version__}", f"cdb: {PLACES} of {len(away)} posts of level {max(levels)} on the DEM at most {chosen.max():.5f} m off")
    assert levels == set(range(-10, max(levels) + 1)) and chosen.max() <= 2e-3, chosen.max()


def main():
    with tempfile.TemporaryDirectory() as folder:
        unreal(pathlib.Path(folder))
        unity(pathlib.Path(folder))
        cdb(pathlib.Path(folder))


main()
