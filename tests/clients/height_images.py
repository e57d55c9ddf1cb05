#!/usr/bin/python3
"""Heights as colours of /rgb, read by GDAL and numpy, against the DEM.

    height_images.py      with the program in $TIND_BINARY

Pixels that lie on posts are these within half a step, on both sides of every seam; pixels between
posts are what bilinear interpolation makes of the DEM. WebP tiles have the pixels of the PNGs.
"""
import json
import math
import os
import pathlib
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
from web_map import PIXELS, Daemon, Grid, between, description, places_of, read_image, tiles_within

gdal.UseExceptions()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
REAL = ROOT / "testdata/bigtujunga_crop.tif"
EARTH = 2 * math.pi * 6378137
LEVEL, FIRST, POSTS = 13, (1400 * PIXELS + 400, 3260 * PIXELS + 330), 420   # of the map's pixels: over four tiles
READER = f"GDAL {gdal.__version__}"
STEPS = {"mapbox": .1, "terrarium": 1 / 256}


def decode(pixels, encoding):
    red, green, blue = pixels.astype(float)
    if encoding == "mapbox":
        return -10000 + (red * 65536 + green * 256 + blue) / 10
    return red * 256 + green + blue / 256 - 32768


def dem_on_pixels(path):
    """Posts at the centres of the map's pixels; rough, so that a pixel off shows."""
    heights = np.random.default_rng(7).uniform(-400, 4000, (POSTS, POSTS)).astype(np.float32)
    pixel = EARTH / 2 ** LEVEL / PIXELS
    made = gdal.GetDriverByName("GTiff").Create(str(path), POSTS, POSTS, 1, gdal.GDT_Float32)
    made.SetGeoTransform((FIRST[0] * pixel - EARTH / 2, pixel, 0, EARTH / 2 - FIRST[1] * pixel, 0, -pixel))
    srs = osr.SpatialReference()
    srs.ImportFromEPSG(3857)
    made.SetProjection(srs.ExportToWkt())
    made.GetRasterBand(1).WriteArray(heights)
    made.FlushCache()
    return heights.astype(float)


def on_posts(daemon, name, wanted, encoding):
    """Largest difference, number of pixels, number of tiles."""
    described = json.loads(daemon.get(f"rgb/{name}/tiles.json?encoding={encoding}"))
    assert described["maxzoom"] == LEVEL, described
    got = np.full(wanted.shape, np.nan)
    tiles = 0
    for x in range(FIRST[0] // PIXELS, (FIRST[0] + POSTS - 1) // PIXELS + 1):
        for y in range(FIRST[1] // PIXELS, (FIRST[1] + POSTS - 1) // PIXELS + 1):
            heights = decode(read_image(daemon.get(f"rgb/{name}/{LEVEL}/{x}/{y}.png?encoding={encoding}")), encoding)
            left, top = x * PIXELS - FIRST[0], y * PIXELS - FIRST[1]
            rows, cols = slice(max(top, 0), min(top + PIXELS, POSTS)), slice(max(left, 0), min(left + PIXELS, POSTS))
            got[rows, cols] = heights[rows.start - top:rows.stop - top, cols.start - left:cols.stop - left]
            tiles += 1
    assert np.isfinite(got).all()
    return np.abs(got - wanted).max(), got.size, tiles


def between_posts(daemon, name, dem, encoding):
    described = json.loads(daemon.get(f"rgb/{name}/tiles.json?encoding={encoding}"))
    posts = gdal.Open(str(dem)).ReadAsArray().astype(float)
    grid, away = Grid(dem), []
    for z, x, y in tiles_within(described):
        heights = decode(read_image(daemon.get(f"rgb/{name}/{z}/{x}/{y}.png?encoding={encoding}")), encoding)
        col, row, _ = grid.places(*places_of(z, x, y))
        wanted = between(posts, col, row)
        away.append(np.abs(heights.ravel() - wanted)[np.isfinite(wanted)])
    away = np.concatenate(away)
    return away.max(), len(away)


def of_mesh(daemon, name, wanted, encoding, step):
    """Pixels of the tiles' mesh at posts: how far, at most, beside what is stated, and how far from /elevation's
    answer for the level."""
    described = json.loads(daemon.get(f"rgb/{name}/tiles.json?encoding={encoding}&surface=mesh"))
    assert described["surface"] == "mesh" and described["maxzoom"] >= LEVEL and "surface=mesh" in described["tiles"][0], described
    most, share, pixels, places, seen = 0, 0, 0, [], []
    for z, x, y in tiles_within(described | {"maxzoom": LEVEL}):
        path = f"rgb/{name}/{z}/{x}/{y}.png?encoding={encoding}&surface=mesh"
        heights, stated = decode(read_image(daemon.get(path)), encoding), float(daemon.header(path, "Tind-Max-Error"))
        left, top = x * PIXELS - FIRST[0], y * PIXELS - FIRST[1]
        lon, lat = (values.reshape(PIXELS, PIXELS) for values in places_of(z, x, y))
        rows, cols = slice(max(top, 0), min(top + PIXELS, POSTS)), slice(max(left, 0), min(left + PIXELS, POSTS))
        here = slice(rows.start - top, rows.stop - top), slice(cols.start - left, cols.stop - left)
        away = np.abs(heights[here] - wanted[rows, cols]).max()
        assert away <= stated + step / 2 + 1e-3, (path, away, stated)
        most, share, pixels = max(most, away), max(share, away / stated), pixels + heights[here].size
        for values, of in ((places, np.stack([lon[here], lat[here]], -1).reshape(-1, 2)), (seen, heights[here].ravel())):
            values.extend(of[::53].tolist())
    answer = json.loads(daemon.post(f"elevation/{name}?surface=level={LEVEL}", {"locations": places}))
    apart = np.abs(np.array(answer["height_m"], float) - seen).max()
    return most, share, pixels, apart, len(seen)


def in_webp(daemon, name, resource, query, texts):
    """Tiles of the deepest levels with the same pixels; bytes of the PNGs and of these."""
    described = json.loads(daemon.get(f"{resource}/{name}/tiles.json?{query}&format=webp"))
    assert described["format"] == "webp" and ".webp?" in described["tiles"][0], described
    sizes = [], []
    for level in (described["maxzoom"] - 1, described["maxzoom"]):
        for z, x, y in tiles_within(described | {"maxzoom": level}):
            png, webp = (daemon.get(f"{resource}/{name}/{z}/{x}/{y}.{ending}?{query}") for ending in ("png", "webp"))
            pixels, wanted = read_image(webp), read_image(png)
            if len(wanted) == 2:   # WebP has no grey
                wanted = wanted[[0, 0, 0, 1]]
            if len(pixels) < len(wanted):   # nor an alpha that is whole everywhere
                assert (wanted[3] == 255).all()
                wanted = wanted[:3]
            assert np.array_equal(pixels, wanted), (resource, query, z, x, y)
            assert all(text in description(webp) for text in texts), description(webp)
            sizes[0].append(len(png))
            sizes[1].append(len(webp))
    return len(sizes[0]), sum(sizes[0]), sum(sizes[1])


def mesh_in_batch(daemon, dem, folder):
    """Files of `tind build --surface mesh`, which are the daemon's to the byte."""
    subprocess.run([os.environ["TIND_BINARY"], "build", dem, "-o", folder, "--format", "rgb", "--surface", "mesh",
                    "--progress", "none"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    files = sorted(folder.rglob("*.png"))
    for file in files:
        path = file.relative_to(folder).as_posix()
        assert file.read_bytes() == daemon.get(f"rgb/{dem.stem}/{path}?surface=mesh"), path
    described = json.loads((folder / "tiles.json").read_text())
    assert described["surface"] == "mesh" and described["tiles"] == ["{z}/{x}/{y}.png"], described
    return len(files)


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "pixels.tif"
        wanted = dem_on_pixels(path)
        daemon = Daemon([path, REAL])
        try:
            for encoding, step in STEPS.items():
                most, pixels, tiles = on_posts(daemon, path.stem, wanted, encoding)
                figure(READER, f"{encoding}: {pixels} pixels on posts in {tiles} tiles: at most {most:.5f} m off, half a step is {step / 2:.5f} m")
                # What the DEM's own places and those of the pixels differ by, times the steepest cell.
                assert tiles == 4 and pixels >= 10000 and most <= step / 2 + 1e-3, (encoding, most)
                most, pixels = between_posts(daemon, REAL.stem, REAL, encoding)
                figure(READER, f"{encoding}: {pixels} pixels between posts: at most {most:.5f} m off bilinear interpolation")
                assert pixels >= 10000 and most <= step / 2 + .02, (encoding, most)
                most, share, pixels, apart, places = of_mesh(daemon, path.stem, wanted, encoding, step)
                figure(READER, f"{encoding}: {pixels} pixels of the mesh on posts: at most {most:.3f} m off, {share:.2f} of what is stated; "
                      f"at most {apart:.5f} m from /elevation at {places} places")
                assert pixels == POSTS * POSTS and most > step and apart <= step / 2 + 1e-3, (encoding, most, apart)
                tiles, png, webp = in_webp(daemon, REAL.stem, "rgb", f"encoding={encoding}", [f"Encoding: {encoding}", f"Step in metres: {step}"])
                figure(READER, f"{encoding}: {tiles} tiles have the same pixels as WebP; {png} bytes as PNG, {webp} as WebP")
            files = mesh_in_batch(daemon, REAL, pathlib.Path(folder) / "mesh")
            print(f"{files} images of the mesh in batch, byte by byte as on demand")
            assert files > 12, files
            for style in ("hillshade", "slope", "aspect"):
                tiles, png, webp = in_webp(daemon, REAL.stem, "shade", f"style={style}", [f"Style: {style}"])
                figure(READER, f"{style}: {tiles} tiles have the same pixels as WebP; {png} bytes as PNG, {webp} as WebP")
        finally:
            daemon.stop()


main()
