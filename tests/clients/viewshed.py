#!/usr/bin/python3
"""tind viewshed against gdal_viewshed, on Mount Rainier in metres (UTM).

    viewshed.py      with the program in $TIND_BINARY

gdal_viewshed is no truth: it takes the ground between posts from a plane through two neighbours of
each post, and the earth's curve as a drop from the observer's own level. So the two agree but for
posts that are barely seen or barely hidden; a third opinion, rays with a sample every fifth of a
post, says who is right where they differ.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

SKIPPED = 77
try:
    import numpy as np
    from osgeo import gdal
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)

gdal.UseExceptions()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TIND = os.environ["TIND_BINARY"]
SPACING, EYE, TARGET, REFRACTION = 80, 10, 5, 0.13
RADIUS_M = 6.378e6  # of the earth, to a third of a per cent


def read(path):
    return gdal.Open(str(path)).ReadAsArray().astype(float)


def sampled(heights, eye, target):
    """Least clearance of the ray from post to post, by samples."""
    (c0, r0), (c1, r1) = eye, target
    count = max(2, int(5 * np.hypot(c1 - c0, r1 - r0)))
    u = np.arange(1, count) / count
    x, y = c0 + (c1 - c0) * u, r0 + (r1 - r0) * u
    c, r = np.minimum(x.astype(int), heights.shape[1] - 2), np.minimum(y.astype(int), heights.shape[0] - 2)
    fx, fy = x - c, y - r
    ground = ((heights[r, c] * (1 - fx) + heights[r, c + 1] * fx) * (1 - fy)
              + (heights[r + 1, c] * (1 - fx) + heights[r + 1, c + 1] * fx) * fy)
    length = np.hypot(c1 - c0, r1 - r0) * SPACING
    a, b = heights[r0, c0] + EYE, heights[r1, c1] + TARGET
    ray = a + (b - a) * u - (1 - REFRACTION) * u * (1 - u) * length**2 / (2 * RADIUS_M)
    return (ray - ground).min()


def compare(folder, col, row):
    dem = folder / "utm.tif"
    source = gdal.Open(str(dem))
    place = source.GetGeoTransform()
    x, y = place[0] + (col + .5) * SPACING, place[3] - (row + .5) * SPACING
    ours_file, theirs_file = folder / "ours.tif", folder / "theirs.tif"
    subprocess.run([TIND, "viewshed", dem, "-o", ours_file, f"--from={x},{y}", "--places-crs=EPSG:32610",
                    f"--from-height={EYE}", f"--to-height={TARGET}", f"--refraction={REFRACTION}"],
                   check=True, stdout=subprocess.DEVNULL)
    gdal.ViewshedGenerate(source.GetRasterBand(1), "GTiff", str(theirs_file), [], x, y, EYE, TARGET, 1, 0, 255, 255,
                          1 - REFRACTION, 2, 0)
    ours, theirs, heights = read(ours_file), read(theirs_file), read(dem)
    assert ours.shape == theirs.shape, (ours.shape, theirs.shape)
    known = (ours < 2) & (theirs < 2)
    differ = np.argwhere(known & (ours != theirs))
    right = wrong = 0
    for r, c in differ:
        clearance = sampled(heights, (col, row), (c, r))
        ours_is_right = (clearance >= 0) == (ours[r, c] == 1)
        right += ours_is_right
        # Samples see no ridge better than to a few decimetres, nor the radius to a third of a per cent.
        wrong += not ours_is_right and abs(clearance) > 0.5
    agree = 1 - len(differ) / known.sum()
    print(f"from {col}, {row}: {known.sum()} posts, {100 * (ours[known] == 1).mean():.1f} % visible, "
          f"{100 * agree:.2f} % as gdal_viewshed's; of the {len(differ)} others samples give {right} to tind")
    assert known.sum() > .9 * ours.size
    assert agree > .97, agree
    assert wrong == 0, wrong


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    gdal.Warp(str(folder / "utm.tif"), str(ROOT / "testdata/rainier.tif"), dstSRS="EPSG:32610", xRes=SPACING, yRes=SPACING,
              outputBounds=(580000, 5172000, 608000, 5184000), resampleAlg="bilinear", outputType=gdal.GDT_Float32)
    for col, row in ((100, 40), (240, 75), (310, 120)):
        compare(folder, col, row)
