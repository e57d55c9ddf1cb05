#!/usr/bin/python3
"""Hillshade, slope and aspect of /shade against gdaldem on a DEM in metres (UTM).

    shades.py      with the program in $TIND_BINARY

Where the two differ, and why: gdaldem weighs 3 x 3 posts (Horn), or takes the two posts on each side
(Zevenbergen and Thorne), and counts directions from grid north; /shade takes the mean of the gradient
of the interpolated surface over a pixel, and counts from true north. So gradients are compared, of
gdaldem turned by the meridian convergence and interpolated between posts, on smooth terrain, where
what is left is the rounding of 8 bits, and on real terrain, where a pixel of about a post is as sharp
as Zevenbergen and Thorne, and sharper than Horn.
"""
import json
import math
import pathlib
import sys
import tempfile

SKIPPED = 77
try:
    import numpy as np
    from osgeo import gdal
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)

from figure import figure
from web_map import Daemon, Grid, between, places_of, read_image, tiles_within

gdal.UseExceptions()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
REAL = ROOT / "testdata/bigtujunga_crop.tif"  # UTM zone 11


def smooth_dem(path, like):
    """Hills that are wide beside the posts."""
    source = gdal.Open(str(like))
    transform, srs, wide, high = source.GetGeoTransform(), source.GetProjection(), source.RasterXSize, source.RasterYSize
    x, y = np.meshgrid(np.arange(wide), np.arange(high))
    heights = 900 + 14 * transform[1] * np.sin(x / 23 + .4) * np.cos(y / 29) + 3 * transform[1] * np.sin((x + 2 * y) / 41)
    made = gdal.GetDriverByName("GTiff").Create(str(path), wide, high, 1, gdal.GDT_Float32)
    made.SetGeoTransform(transform)
    made.SetProjection(srs)
    made.GetRasterBand(1).WriteArray(heights.astype(np.float32))
    made.FlushCache()


def gdaldem(dem, what, **options):
    made = gdal.DEMProcessing("", str(dem), what, format="MEM", **options)
    return made.GetRasterBand(1).ReadAsArray().astype(float)


def gradients(dem, algorithm):
    """By gdaldem: rise to grid east and grid north at each post."""
    slope = np.radians(gdaldem(dem, "slope", alg=algorithm))
    aspect = np.radians(gdaldem(dem, "aspect", alg=algorithm, zeroForFlat=True))
    bad = slope < 0
    east, north = -np.tan(slope) * np.sin(aspect), -np.tan(slope) * np.cos(aspect)
    east[bad], north[bad] = np.nan, np.nan
    return east, north


def hue(colours):
    """Of full colours: one channel is 255, one 0."""
    r, g, b = (colours[i].astype(float) / 255 for i in range(3))
    return 60 * np.where(r == 1, (g - b) % 6, np.where(g == 1, 2 + b - r, 4 + r - g))


def tiles_of(daemon, name, style):
    """All of the deepest level: longitudes, latitudes, channels of every pixel."""
    for z, x, y in tiles_within(json.loads(daemon.get(f"shade/{name}/tiles.json?style={style}"))):
        pixels = read_image(daemon.get(f"shade/{name}/{z}/{x}/{y}.png?style={style}"))
        yield *places_of(z, x, y), pixels.reshape(len(pixels), -1)


def compare(daemon, dem, name):
    """95th percentiles of the differences to either way of gdaldem, by style."""
    grid, found = Grid(dem), {}
    for algorithm in ("Horn", "ZevenbergenThorne"):
        at_posts = gradients(dem, algorithm)
        for style in ("hillshade", "slope", "aspect"):
            differences = []
            for lon, lat, pixels in tiles_of(daemon, name, style):
                col, row, turn = grid.places(lon, lat)
                grid_east, grid_north = (between(part, col, row) for part in at_posts)
                east = grid_east * np.cos(turn) + grid_north * np.sin(turn)
                north = grid_north * np.cos(turn) - grid_east * np.sin(turn)
                steep = np.hypot(east, north)
                there = np.isfinite(steep) & (pixels[-1] == 255)
                if style == "slope":
                    away = pixels[0].astype(float) * 90 / 255 - np.degrees(np.arctan(steep))
                elif style == "aspect":
                    there &= steep > math.tan(math.radians(5))
                    away = (hue(pixels) - np.degrees(np.arctan2(-east, -north)) + 180) % 360 - 180
                else:
                    light = (east - north) / 2 + math.sqrt(.5)  # from the north-west, 45 degrees high
                    away = pixels[0].astype(float) - (1 + 254 * np.maximum(0, light / np.sqrt(1 + steep ** 2)))
                differences.append(np.abs(away[there]))
            all_of = np.concatenate(differences)
            assert len(all_of) > 10000, (style, len(all_of))
            found[style, algorithm] = np.percentile(all_of, 95)
            figure(f"gdaldem {gdal.__version__}", f"{style} of {name}, {algorithm}: {len(all_of)} pixels, differences of median {np.median(all_of):.2f}, "
                  f"95 % {np.percentile(all_of, 95):.2f}, most {all_of.max():.2f}")
    return found


def main():
    with tempfile.TemporaryDirectory() as folder:
        smooth = pathlib.Path(folder) / "smooth.tif"
        smooth_dem(smooth, REAL)
        daemon = Daemon([smooth, REAL])
        try:
            flat, real = compare(daemon, smooth, smooth.stem), compare(daemon, REAL, REAL.stem)
        finally:
            daemon.stop()
    for algorithm in ("Horn", "ZevenbergenThorne"):
        for style, most in (("slope", .3), ("aspect", 1), ("hillshade", 1.5)):
            assert flat[style, algorithm] < most, (style, algorithm, flat)
    for style, most in (("slope", 3), ("hillshade", 10)):
        assert real[style, "ZevenbergenThorne"] < real[style, "Horn"] < 2 * most, (style, real)
        assert real[style, "ZevenbergenThorne"] < most, (style, real)


main()
