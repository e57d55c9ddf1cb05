"""What the tests of images have in common: a daemon, tiles of web maps, places of a DEM."""
import json
import math
import os
import socket
import subprocess
import time
import urllib.request
from xml.etree import ElementTree

import numpy as np
from osgeo import gdal, osr

os.environ.setdefault("TIND_AS_ROOT", "true")  # at work here alone, maybe where there is no other user
PIXELS = 512


class Daemon:
    def __init__(self, files):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.address = "127.0.0.1:%d" % probe.getsockname()[1]
        self.process = subprocess.Popen([os.environ["TIND_BINARY"], "serve", *map(str, files), "--listen", self.address],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(300):
            try:
                self.get("readyz")
                return
            except OSError:
                time.sleep(.1)
        raise RuntimeError("tind serve did not start")

    def get(self, path):
        with urllib.request.urlopen(f"http://{self.address}/{path}") as reply:
            return reply.read()

    def header(self, path, name):
        with urllib.request.urlopen(f"http://{self.address}/{path}") as reply:
            return reply.headers[name]

    def post(self, path, document):
        request = urllib.request.Request(f"http://{self.address}/{path}", json.dumps(document).encode(), {"Content-Type": "application/json"})
        with urllib.request.urlopen(request) as reply:
            return reply.read()

    def stop(self):
        self.process.terminate()
        assert self.process.wait(30) == 0


class Grid:
    def __init__(self, dem):
        source = gdal.Open(str(dem))
        self.transform, wkt = source.GetGeoTransform(), source.GetProjection()
        utm, wgs84 = osr.SpatialReference(wkt), osr.SpatialReference()
        wgs84.ImportFromEPSG(4326)
        for srs in (utm, wgs84):
            srs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        self.to_utm = osr.CoordinateTransformation(wgs84, utm)

    def places(self, lon, lat):
        """Columns and rows of posts, and how far grid north lies east of true north, radians."""
        at = np.array(self.to_utm.TransformPoints(np.stack([lon, lat], 1)))[:, :2]
        north = np.array(self.to_utm.TransformPoints(np.stack([lon, lat + 1e-4], 1)))[:, :2] - at
        x0, dx, _, y0, _, dy = self.transform
        return (at[:, 0] - x0) / dx - .5, (at[:, 1] - y0) / dy - .5, -np.arctan2(north[:, 0], north[:, 1])


def between(values, col, row):
    c, r = np.floor(col).astype(int), np.floor(row).astype(int)
    inside = (c >= 0) & (r >= 0) & (c + 1 < values.shape[1]) & (r + 1 < values.shape[0])
    c, r = np.where(inside, c, 0), np.where(inside, r, 0)
    x, y = col - c, row - r
    mean = (values[r, c] * (1 - x) + values[r, c + 1] * x) * (1 - y) + (values[r + 1, c] * (1 - x) + values[r + 1, c + 1] * x) * y
    return np.where(inside, mean, np.nan)


def read_image(data):
    gdal.FileFromMemBuffer("/vsimem/tile", data)
    pixels = gdal.Open("/vsimem/tile").ReadAsArray()
    gdal.Unlink("/vsimem/tile")
    return pixels


def description(webp):
    """What its XMP chunk says (GDAL 3.6 reads that of an older description of the format only)."""
    chunks, at = {}, 12
    while at < len(webp):
        size = int.from_bytes(webp[at + 4:at + 8], "little")
        chunks[webp[at:at + 4]] = webp[at + 8:at + 8 + size]
        at += 8 + size + size % 2
    assert at == len(webp) and chunks[b"VP8X"][0] & 4, chunks.keys()
    return "".join(ElementTree.fromstring(chunks[b"XMP "]).itertext())


def tiles_within(described):
    """z, x, y of the deepest level, by a TileJSON."""
    z, (west, south, east, north) = described["maxzoom"], described["bounds"]
    side = 2 ** z
    column = lambda lon: int((lon + 180) / 360 * side)
    row = lambda lat: int((1 - math.asinh(math.tan(math.radians(lat))) / math.pi) / 2 * side)
    return [(z, x, y) for x in range(column(west), column(east) + 1) for y in range(row(north), row(south) + 1)]


def places_of(z, x, y):
    """Longitudes and latitudes of a tile's pixels, row by row."""
    u, v = np.meshgrid(x + (np.arange(PIXELS) + .5) / PIXELS, y + (np.arange(PIXELS) + .5) / PIXELS)
    lon = u.ravel() / 2 ** z * 360 - 180
    return lon, np.degrees(np.arctan(np.sinh(math.pi * (1 - 2 * v.ravel() / 2 ** z))))
