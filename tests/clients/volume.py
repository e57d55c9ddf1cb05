#!/usr/bin/python3
"""tind volume and tind statistics against numpy, for 20 polygons on a DEM in metres (UTM).

    volume.py      with the program in $TIND_BINARY

numpy sums the bilinear surface at 20 x 20 places a cell; posts inside a polygon it counts one by one.
"""
import json
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
DEM = ROOT / "testdata/bigtujunga_crop.tif"  # UTM zone 11
TIND = os.environ["TIND_BINARY"]
SAMPLES = 20


def tind(*words):
    return subprocess.run([TIND, *map(str, words)], check=True, capture_output=True, text=True).stdout


def star(random, middle, size, points):
    angles = np.linspace(0, 2 * np.pi, points, endpoint=False)
    radii = size * random.uniform(.3, 1, points)
    return np.stack([middle[0] + radii * np.cos(angles), middle[1] + radii * np.sin(angles)], axis=1)


def inside(ring, x, y):
    odd = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0)):
        if ay != by:
            odd ^= ((ay <= y) != (by <= y)) & (x < ax + (bx - ax) * (y - ay) / (by - ay))
    return odd


def sampled(heights, ring, level):
    """Area in cells, sums of what is above and below."""
    c0, r0 = np.floor(ring.min(axis=0)).astype(int)
    c1, r1 = np.ceil(ring.max(axis=0)).astype(int)
    at = (np.arange(SAMPLES) + .5) / SAMPLES
    x = (np.arange(c0, c1)[:, None] + at).ravel()
    y = (np.arange(r0, r1)[:, None] + at).ravel()
    x, y = np.meshgrid(x, y)
    mask = inside(ring, x, y)
    x, y = x[mask], y[mask]
    c, r = x.astype(int), y.astype(int)
    fx, fy = x - c, y - r
    z = ((heights[r, c] * (1 - fx) + heights[r, c + 1] * fx) * (1 - fy)
         + (heights[r + 1, c] * (1 - fx) + heights[r + 1, c + 1] * fx) * fy) - level
    cell = 1 / SAMPLES**2
    return len(z) * cell, z[z > 0].sum() * cell, -z[z < 0].sum() * cell


def main(folder):
    source = gdal.Open(str(DEM))
    heights = source.ReadAsArray().astype(float)
    place = source.GetGeoTransform()
    m2 = abs(place[1] * place[5])
    random = np.random.default_rng(7)
    code = source.GetSpatialRef().GetAuthorityCode(None)
    rings, features = [], []
    for _ in range(20):
        size = random.uniform(6, 30)
        middle = [random.uniform(size + 1, n - size - 2) for n in heights.shape[::-1]]
        ring = star(random, middle, size, random.integers(3, 12))
        rings.append(ring)
        places = [[place[0] + (x + .5) * place[1], place[3] + (y + .5) * place[5]] for x, y in ring]
        features.append({"type": "Feature", "properties": {},
                         "geometry": {"type": "Polygon", "coordinates": [places + places[:1]]}})
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{code}"}}

    def write(path, which):
        path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": which}))
        return path

    worst = worst_area = 0
    for ring, feature in zip(rings, features):
        level = float(np.median(heights))
        found = json.loads(tind("volume", DEM, "--height", level, "--json", "--area",
                                write(folder / "one.geojson", [feature])))
        area, above, below = sampled(heights, ring, level)
        scale = m2 * (above + below)
        worst_area = max(worst_area, abs(found["area_m2"] - area * m2) / (area * m2))
        for name, value in (("cut", above), ("fill", below)):
            worst = max(worst, abs(found[name]["m3"] - value * m2) / scale)
    print(f"volume: 20 polygons, within {worst:.1e} of numpy's sums, areas within {worst_area:.1e}")
    assert worst < 5e-3 and worst_area < 5e-3

    rows = json.loads(tind("statistics", DEM, "--json", "--polygons", write(folder / "all.geojson", features)))
    y, x = np.mgrid[0:heights.shape[0], 0:heights.shape[1]].astype(float)
    for row, ring in zip(rows["polygons"], rings):
        z = heights[inside(ring, x, y)]
        theirs = {"posts": z.size, "min_m": z.min(), "max_m": z.max(), "mean_m": z.mean(), "std_m": z.std(),
                  "median_m": np.median(z)}
        for name, value in theirs.items():
            assert abs(row[name] - value) < 1e-4, (name, row[name], value)
    print("statistics: 20 polygons, posts, least, greatest, mean, deviation and median as numpy's")


with tempfile.TemporaryDirectory() as name:
    main(pathlib.Path(name))
