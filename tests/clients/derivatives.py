#!/usr/bin/python3
"""tind slope, aspect, hillshade, roughness, tri and tpi against gdaldem, tind contours against
GDAL's own contours, on a DEM in metres (UTM).

    derivatives.py      with the program in $TIND_BINARY

gdaldem leaves the rim without values; there, only tind has some.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

SKIPPED = 77
try:
    import numpy as np
    from osgeo import gdal, ogr
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)

gdal.UseExceptions()
ogr.UseExceptions()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEM = ROOT / "testdata/bigtujunga_crop.tif"  # UTM zone 11
TIND = os.environ["TIND_BINARY"]

# What is compared: tind's options, gdaldem's name and options, the largest difference allowed.
CASES = [
    ("slope", [], "slope", {}, 1e-3),
    ("slope", ["--percent"], "slope", {"slopeFormat": "percent"}, 1e-2),
    ("aspect", [], "aspect", {}, 1e-2),
    ("hillshade", ["--azimuth", "300", "--altitude", "35"], "hillshade", {"azimuth": 300, "altitude": 35}, 1),
    ("roughness", [], "roughness", {}, 1e-3),
    ("tri", [], "TRI", {"alg": "Riley"}, 1e-2),
    ("tpi", [], "TPI", {}, 1e-3),
]


def tind(*words):
    subprocess.run([TIND, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def read(path):
    raster = gdal.Open(str(path))
    values = raster.GetRasterBand(1).ReadAsArray().astype(float)
    nothing = raster.GetRasterBand(1).GetNoDataValue()
    values[values == nothing] = np.nan
    return values, raster.GetGeoTransform()


def compare_rasters(folder):
    source = gdal.Open(str(DEM))
    for kind, options, name, how, most in CASES:
        path = folder / f"{kind}.tif"
        tind(kind, DEM, "-o", path, *options)
        ours, place = read(path)
        made = gdal.DEMProcessing("", str(DEM), name, format="MEM", **how)
        theirs = made.GetRasterBand(1).ReadAsArray().astype(float)
        theirs[theirs == made.GetRasterBand(1).GetNoDataValue()] = np.nan
        assert place == source.GetGeoTransform(), (place, source.GetGeoTransform())
        assert ours.shape == theirs.shape
        both = np.isfinite(theirs) & np.isfinite(ours)
        assert both.sum() > .95 * ours.size, f"{kind}: {both.sum()} of {ours.size}"
        difference = np.abs(ours - theirs)[both]
        if kind == "aspect":
            difference = np.minimum(difference, 360 - difference)
        print(f"{kind} {' '.join(options)}: {both.sum()} posts, at most {difference.max():.2g} from gdaldem's")
        assert difference.max() <= most, kind


def heights_and_length(layer):
    """Of each height the length of its lines."""
    lengths = {}
    for feature in layer:
        height = round(feature.GetField(layer.GetLayerDefn().GetFieldIndex("height_m")), 6)
        lengths[height] = lengths.get(height, 0) + feature.GetGeometryRef().Length()
    return lengths


def compare_contours(folder):
    path = folder / "lines.gpkg"
    tind("contours", DEM, "-o", path, "--interval", 50, "--base", 7)
    file = ogr.Open(str(path))  # a layer lives no longer than its file
    ours = heights_and_length(file.GetLayer(0))
    made = ogr.GetDriverByName("Memory").CreateDataSource("lines")
    layer = made.CreateLayer("lines", None, ogr.wkbLineString)
    layer.CreateField(ogr.FieldDefn("height_m", ogr.OFTReal))
    dem = gdal.Open(str(DEM))
    gdal.ContourGenerate(dem.GetRasterBand(1), 50, 7, [], 0, 0, layer, -1, 0)
    theirs = heights_and_length(layer)
    assert set(ours) == set(theirs), (sorted(ours), sorted(theirs))
    worst = max(abs(ours[h] - theirs[h]) / theirs[h] for h in theirs)
    print(f"contours: {len(ours)} heights, lengths within {worst:.1e} of GDAL's")
    assert worst < 1e-6


with tempfile.TemporaryDirectory() as name:
    compare_rasters(pathlib.Path(name))
    compare_contours(pathlib.Path(name))
