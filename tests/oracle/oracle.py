#!/usr/bin/python3
"""An independent oracle: what tind says of its tiles, recomputed by somebody else.

GDAL and numpy only: an own decoder of quantized-mesh, own formulas, nothing of tind's code. For every
tile of a pyramid: the maximum vertical error over all posts of the source in its closed rectangle
(never above the stated one; equal where it is called exact), the number of posts, an exact cover of
the rectangle without flips, the bounding sphere, and with the neighbours shared edges bit by bit.

    oracle.py DIR DEM            checks tiles that are there (made with --to-datum same)
    oracle.py --build DEM...     makes them first, with the program in $TIND_BINARY
    oracle.py --layers [--blend M] DIR LOWEST ... HIGHEST
                                 tiles of layers, each FILE[,FILE...] of one grid; with --build too

Of layers a post counts where no higher layer has four valid posts around it. Where one has some, or a
valid post within the blend, its height is not the oracle's to say: such posts are left out.

With --geoid tind adds the undulation of EGM96, and so does the oracle, from PROJ's own grid. Further
options go behind --options, e.g. --options --max-error 5. Exit code 0: no disagreement.
"""
import argparse
import json
import multiprocessing
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np
from osgeo import gdal, osr

gdal.UseExceptions()
END = 32767
ROUNDING = 2e-6       # metres: the sixth digit is the last one stated
PLACING = 1e-3        # metres: posts of projections, and of globes whose step is rounded
EXACT = 1e-5          # metres: how far a stated maximum may be above ours where it is called exact
PAIRS = 2_000_000     # (triangle, post) pairs looked at together
A, B = 6378137.0, 6356752.314245179


# ---- the source ----

class Geoid:
    """Undulations, bilinear over PROJ's EGM96 grid."""
    FILES = ["/usr/share/proj/us_nga_egm96_15.tif", "/usr/share/proj/egm96_15.gtx"]
    TOLERANCE = 0.0016    # metres: tind's grid holds multiples of 3 mm

    def __init__(self):
        data = gdal.Open(next(f for f in self.FILES if os.path.exists(f)))
        x0, self.dx, _, y0, _, self.dy = data.GetGeoTransform()
        self.x0, self.y0 = x0 + self.dx / 2, y0 + self.dy / 2
        n = data.ReadAsArray().astype(np.float64)
        self.n = np.concatenate([n, n[:, :1]], axis=1)    # around the globe

    def __call__(self, lon, lat):
        col, row = (lon - self.x0) / self.dx, (lat - self.y0) / self.dy
        col %= self.n.shape[1] - 1
        i, j = np.floor(col).astype(int), np.clip(np.floor(row).astype(int), 0, self.n.shape[0] - 2)
        fx, fy = col - i, row - j
        upper = self.n[j, i] * (1 - fx) + self.n[j, i + 1] * fx
        return upper * (1 - fy) + (self.n[j + 1, i] * (1 - fx) + self.n[j + 1, i + 1] * fx) * fy


class Source:
    """Posts as longitudes, latitudes (degrees) and heights (metres, NaN where void)."""

    def __init__(self, path, geoid=None):
        data = gdal.Open(path)
        band = data.GetRasterBand(1)
        z = band.ReadAsArray().astype(np.float64)
        if band.GetNoDataValue() is not None:
            z[z == band.GetNoDataValue()] = np.nan
        x0, dx, rx, y0, ry, dy = data.GetGeoTransform()
        cols, rows = np.arange(data.RasterXSize) + 0.5, np.arange(data.RasterYSize) + 0.5
        crs = data.GetSpatialRef()
        crs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        z *= {"": crs.GetLinearUnits() if crs.IsProjected() else 1, "m": 1, "metre": 1, "meters": 1, "ft": 0.3048,
              "US survey foot": 1200 / 3937}[band.GetUnitType()]
        self.plain = bool(crs.IsGeographic()) and rx == ry == 0
        self.tolerance = ROUNDING if self.plain else PLACING
        if self.plain:
            lon, lat = x0 + cols * dx, y0 + rows * dy
            if abs(len(lon) * dx - 360) < 0.05 * dx:  # around the globe, whose step may be rounded
                self.tolerance = PLACING
                lon = lon[0] + np.arange(len(lon)) * (360 / len(lon))
                lon, z = np.concatenate([lon, lon - 360]), np.concatenate([z, z], axis=1)
            order = np.argsort(lon)
            self.lon, self.lat, self.z = lon[order], lat[::-1], z[::-1, order]
        else:
            x, y = np.meshgrid(cols, rows)
            points = np.stack([(x0 + x * dx + y * rx).ravel(), (y0 + x * ry + y * dy).ravel()], axis=1)
            globe = osr.SpatialReference()
            globe.ImportFromEPSG(4326)
            globe.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
            places = np.array(osr.CoordinateTransformation(crs, globe).TransformPoints(points))
            valid = ~np.isnan(z.ravel())
            order = np.argsort(places[valid, 0])
            self.lon, self.lat = places[valid, 0][order], places[valid, 1][order]
            self.z = z.ravel()[valid][order]
        if geoid:
            self.tolerance += Geoid.TOLERANCE
            self.z = self.z + geoid(*(np.meshgrid(self.lon, self.lat) if self.plain else (self.lon, self.lat)))

    def posts(self, west, south, side):
        """u, v, height of the valid posts in a closed square, u and v in the tile's units."""
        hair = side * 1e-10
        i = slice(*np.searchsorted(self.lon, [west - hair, west + side + hair]))
        if self.plain:
            j = slice(*np.searchsorted(self.lat, [south - hair, south + side + hair]))
            lon, lat = np.meshgrid(self.lon[i], self.lat[j])
            lon, lat, z = lon.ravel(), lat.ravel(), self.z[j, i].ravel()
            inside = ~np.isnan(z)
        else:
            lon, lat, z = self.lon[i], self.lat[i], self.z[i]
            inside = (lat >= south - hair) & (lat <= south + side + hair)
        u, v = (lon - west) / side * END, (lat - south) / side * END
        return np.clip(u[inside], 0, END), np.clip(v[inside], 0, END), z[inside]


class Cover:
    """Which places the cells of a raster's valid posts hold, and which are near them."""

    def __init__(self, path, blend):
        data = gdal.Open(path)
        band = data.GetRasterBand(1)
        z = band.ReadAsArray().astype(np.float64)
        valid = ~np.isnan(z) if band.GetNoDataValue() is None else (z != band.GetNoDataValue()) & ~np.isnan(z)
        self.map = gdal.InvGeoTransform(data.GetGeoTransform())
        crs = data.GetSpatialRef()
        crs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        globe = osr.SpatialReference()
        globe.ImportFromEPSG(4326)
        globe.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        self.from_globe = None if crs.IsGeographic() else osr.CoordinateTransformation(globe, crs)
        to_globe = osr.CoordinateTransformation(crs, globe)
        gt = data.GetGeoTransform()
        corners = [to_globe.TransformPoint(gt[0] + x * gt[1], gt[3] + y * gt[5])
                   for x in (0, data.RasterXSize / 2, data.RasterXSize) for y in (0, data.RasterYSize / 2, data.RasterYSize)]
        metre = 1 / 111320
        lats = [c[1] for c in corners]
        thin = max(0.05, float(np.cos(np.radians(max(abs(min(lats)), abs(max(lats)))))))
        unit = crs.GetLinearUnits() if crs.IsProjected() else 111320 * thin
        self.reach = int(np.ceil(blend / (unit * min(abs(gt[1]), abs(gt[5]))))) + 2
        grow = blend * metre + 3 * max(abs(gt[1]), abs(gt[5])) * (1 if crs.IsGeographic() else unit * metre)
        lons = [c[0] for c in corners]
        self.box = (min(lons) - grow / thin, max(lons) + grow / thin, min(lats) - grow, max(lats) + grow)
        self.rows, self.cols = valid.shape
        self.sums = np.zeros((self.rows + 1, self.cols + 1), np.int64)
        self.sums[1:, 1:] = valid.cumsum(0).cumsum(1)

    def count(self, c0, c1, r0, r1):
        c0, c1 = np.clip(c0, 0, self.cols), np.clip(c1, 0, self.cols)
        r0, r1 = np.clip(r0, 0, self.rows), np.clip(r1, 0, self.rows)
        return self.sums[r1, c1] - self.sums[r0, c1] - self.sums[r1, c0] + self.sums[r0, c0]

    def __call__(self, lon, lat):
        """(held, near) for each place."""
        held, near = np.zeros(len(lon), bool), np.zeros(len(lon), bool)
        some = np.flatnonzero((lon >= self.box[0]) & (lon <= self.box[1]) & (lat >= self.box[2]) & (lat <= self.box[3]))
        if len(some) == 0:
            return held, near
        x, y = lon[some], lat[some]
        if self.from_globe:
            x, y, _ = np.array(self.from_globe.TransformPoints(np.stack([x, y], axis=1))).T
        g = self.map
        col, row = g[0] + x * g[1] + y * g[2] - 0.5, g[3] + x * g[4] + y * g[5] - 0.5
        for a in (col, row):
            on = np.abs(a - np.round(a)) < 1e-6
            a[on] = np.round(a[on])
        c, r = np.floor(col).astype(np.int64), np.floor(row).astype(np.int64)
        c1, r1 = np.ceil(col).astype(np.int64), np.ceil(row).astype(np.int64)
        held[some] = self.count(c, c1 + 1, r, r1 + 1) == (c1 - c + 1) * (r1 - r + 1)
        near[some] = self.count(c - self.reach, c1 + 1 + self.reach, r - self.reach, r1 + 1 + self.reach) > 0
        return held, near


class Layers:
    """The posts that decide, of layers given from the lowest to the highest."""
    plain, tolerance = False, PLACING

    def __init__(self, layers, blend, geoid=None):
        parts, above = [], []
        for files in reversed(layers):
            covers = []
            for path in files:
                source = Source(path, geoid)
                self.tolerance = max(self.tolerance, source.tolerance)
                if source.plain:
                    lon, lat = (a.ravel() for a in np.meshgrid(source.lon, source.lat))
                    keep = ~np.isnan(source.z.ravel())
                    lon, lat, z = lon[keep], lat[keep], source.z.ravel()[keep]
                else:
                    lon, lat, z = source.lon, source.lat, source.z
                for cover in above:
                    held, near = cover(lon, lat)
                    sure = ~held & ~near
                    lon, lat, z = lon[sure], lat[sure], z[sure]
                # Of files of one grid the first that has a post says it: the same place again is left out.
                for cover in covers:
                    held, near = cover(lon, lat)
                    lon, lat, z = lon[~held], lat[~held], z[~held]
                parts.append((lon, lat, z))
                covers.append(Cover(path, blend))
            above += covers
        lon, lat, z = (np.concatenate(a) for a in zip(*parts))
        order = np.argsort(lon)
        self.lon, self.lat, self.z = lon[order], lat[order], z[order]

    posts = Source.posts


# ---- a tile ----

def zigzag(codes):
    codes = codes.astype(np.int64)
    return np.cumsum((codes >> 1) ^ -(codes & 1))


class Tile:
    def __init__(self, data):
        self.low, self.high = struct.unpack_from("<2f", data, 24)
        self.sphere = struct.unpack_from("<4d", data, 32)
        at = 88

        def take(dtype, count):
            nonlocal at
            values = np.frombuffer(data, dtype, count, at)
            at += values.nbytes
            return values

        n = int(take("<u4", 1)[0])
        self.u, self.v, self.h = (zigzag(take("<u2", n)) for _ in range(3))
        wide = n > 65536
        at += -at % (4 if wide else 2)
        index = "<u4" if wide else "<u2"
        codes = take(index, 3 * int(take("<u4", 1)[0])).astype(np.int64)
        news = codes == 0
        self.triangles = ((np.cumsum(news) - news) - codes).reshape(-1, 3)
        self.edges = [take(index, int(take("<u4", 1)[0])).astype(np.int64) for _ in range(4)]
        self.normals, self.metadata = np.zeros((n, 0), np.uint8), {}
        while at < len(data):
            kind, size = struct.unpack_from("<BI", data, at)
            body = data[at + 5:at + 5 + size]
            at += 5 + size
            if kind == 1:
                self.normals = np.frombuffer(body, np.uint8).reshape(n, 2)
            if kind == 4:
                self.metadata = json.loads(body[4:4 + struct.unpack_from("<I", body)[0]])
        self.z = self.low + self.h * ((float(self.high) - float(self.low)) / END)

    def side(self, k):
        """Everything that both tiles at an edge must agree on, as bytes."""
        across, along = (self.u, self.v) if k % 2 == 0 else (self.v, self.u)
        on = np.flatnonzero(across == (0 if k < 2 else END))
        on = on[np.argsort(along[on], kind="stable")]
        return along[on].tobytes() + self.z[on].tobytes() + self.normals[on].tobytes()


def expand(counts):
    """For counts 2, 0, 3: owners 0 0 2 2 2 and places 0 1 0 1 2."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


def rows_of(tile, cells):
    """(triangle, row of cells, first and last cell): where triangles lie in a grid over the tile."""
    x, y = tile.u[tile.triangles] * (cells / END), tile.v[tile.triangles] * (cells / END)
    first = np.clip(np.floor(y.min(axis=1) - 1e-6), 0, cells - 1).astype(np.int64)
    last = np.clip(np.floor(y.max(axis=1) + 1e-6), 0, cells - 1).astype(np.int64)
    owner, place = expand(last - first + 1)
    row = first[owner] + place
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for k in range(3):  # each side of the triangle, cut off above and below the row
        xa, ya, xb, yb = (c[owner, i] for c, i in ((x, k), (y, k), (x, (k + 1) % 3), (y, (k + 1) % 3)))
        rise = np.where(ya == yb, 1, yb - ya)
        for level in (row - 1e-6, row + 1 + 1e-6):
            t = np.clip((level - ya) / rise, 0, 1)
            touches = (np.minimum(ya, yb) <= row + 1 + 1e-6) & (np.maximum(ya, yb) >= row - 1e-6)
            for share in (t, np.where(ya == yb, 1 - t, t)):
                at = xa + share * (xb - xa)
                left = np.where(touches, np.minimum(left, at), left)
                right = np.where(touches, np.maximum(right, at), right)
    some = left <= right
    left = np.clip(np.floor(left[some] - 1e-6), 0, cells - 1).astype(np.int64)
    right = np.clip(np.floor(right[some] + 1e-6), 0, cells - 1).astype(np.int64)
    return owner[some], row[some], left, right


def largest_error(tile, u, v, z):
    """The largest |mesh - post|, and how many posts no triangle holds."""
    if len(z) == 0:
        return 0.0, 0
    cells = int(np.clip(np.sqrt(len(z)), 1, 1024))
    cell = (np.minimum(v * cells // END, cells - 1) * cells + np.minimum(u * cells // END, cells - 1)).astype(np.int64)
    order = np.argsort(cell, kind="stable")
    u, v, z = u[order], v[order], z[order]
    start = np.searchsorted(cell[order], np.arange(cells * cells + 1))
    owner, row, left, right = rows_of(tile, cells)
    begin, end = start[row * cells + left], start[row * cells + right + 1]
    covered, worst = np.zeros(len(z), bool), 0.0
    cuts = np.searchsorted(np.cumsum(end - begin), np.arange(0, (end - begin).sum() + PAIRS, PAIRS))
    for low, high in zip(cuts, np.append(cuts[1:], len(begin))):
        which, place = expand(end[low:high] - begin[low:high])
        post = begin[low:high][which] + place
        a, b, c = tile.triangles[owner[low:high][which]].T
        pu, pv = u[post], v[post]

        def weight(p, q):
            return (tile.u[p] - pu) * (tile.v[q] - pv) - (tile.v[p] - pv) * (tile.u[q] - pu)

        wa, wb, wc = weight(b, c), weight(c, a), weight(a, b)
        inside = np.minimum(np.minimum(wa, wb), wc) >= -1e-5
        wa, wb, wc = (np.maximum(w[inside], 0) for w in (wa, wb, wc))
        post = post[inside]
        mesh = (wa * tile.z[a[inside]] + wb * tile.z[b[inside]] + wc * tile.z[c[inside]]) / (wa + wb + wc)
        covered[post] = True
        if len(post):
            worst = max(worst, float(np.abs(mesh - z[post]).max()))
    return worst, int((~covered).sum())


def faults_of_mesh(tile):
    a, b, c = tile.triangles.T
    area = (tile.u[b] - tile.u[a]) * (tile.v[c] - tile.v[a]) - (tile.v[b] - tile.v[a]) * (tile.u[c] - tile.u[a])
    if (area <= 0).any():
        yield f"{(area <= 0).sum()} triangles are flipped or flat"
    if area.sum() != 2 * END * END:
        yield "the triangles do not cover the square once"
    ends = np.concatenate([tile.triangles[:, [0, 1]], tile.triangles[:, [1, 2]], tile.triangles[:, [2, 0]]])
    there, back = ends[:, 0] << 32 | ends[:, 1], ends[:, 1] << 32 | ends[:, 0]
    if len(np.unique(there)) != len(there):
        yield "an edge is used twice in one direction"
    lone = ends[~np.isin(there, back)]
    border = np.zeros(len(lone), bool)
    for x in (tile.u, tile.v):
        border |= (x[lone[:, 0]] == x[lone[:, 1]]) & np.isin(x[lone[:, 0]], (0, END))
    if not border.all():
        yield "an edge inside has one triangle only"
    for k in range(4):
        across = tile.u if k % 2 == 0 else tile.v
        if set(tile.edges[k]) != set(np.flatnonzero(across == (0 if k < 2 else END))):
            yield f"edge list {k} does not name the vertices on its side"


def outside_sphere(tile, west, south, side):
    lon, lat = np.radians(west + tile.u / END * side), np.radians(south + tile.v / END * side)
    curve = A * A / np.sqrt((A * np.cos(lat)) ** 2 + (B * np.sin(lat)) ** 2)
    out = (curve + tile.z) * np.cos(lat)
    place = np.stack([out * np.cos(lon), out * np.sin(lon), ((B / A) ** 2 * curve + tile.z) * np.sin(lat)])
    return np.linalg.norm(place - np.array(tile.sphere[:3])[:, None], axis=0).max() - tile.sphere[3]


# ---- a pyramid ----

SOURCE = FOLDER = None


def look_at(name):
    tile = Tile((FOLDER / f"{name}.terrain").read_bytes())
    z, x, y = map(int, name.split("/"))
    side = 180 / 2 ** z
    west, south = -180 + x * side, -90 + y * side
    faults = list(faults_of_mesh(tile))
    beyond = outside_sphere(tile, west, south, side)
    if beyond > 1e-4:
        faults.append(f"a vertex is {beyond} m outside the bounding sphere")
    u, v, heights = SOURCE.posts(west, south, side)
    truth, bare = largest_error(tile, u, v, heights)
    stated, kind = tile.metadata["max_error_m"], tile.metadata["error_kind"]
    if bare:
        faults.append(f"{bare} posts are over no triangle")
    if truth > stated + SOURCE.tolerance:
        faults.append(f"error {truth} m, stated {stated} m")
    left_out = isinstance(SOURCE, Layers) and tile.metadata["posts"] > len(heights)
    if isinstance(SOURCE, Layers) and tile.metadata["posts"] < len(heights):
        faults.append(f"{len(heights)} posts decide for certain, stated {tile.metadata['posts']}")
    if kind == "exact" and not left_out and stated > truth + max(EXACT, SOURCE.tolerance):
        faults.append(f"error {truth} m, called exact: {stated} m")
    if SOURCE.plain and SOURCE.tolerance == ROUNDING and tile.metadata["posts"] != len(heights):
        faults.append(f"{len(heights)} posts, stated {tile.metadata['posts']}")
    return name, faults, [tile.side(k) for k in range(4)], len(heights), kind == "exact", truth, stated


def check(folder, dem, source):
    global SOURCE, FOLDER
    begin = time.time()
    SOURCE, FOLDER = source, pathlib.Path(folder)
    names = sorted(p.relative_to(FOLDER).with_suffix("").as_posix() for p in FOLDER.glob("*/*/*.terrain"))
    with multiprocessing.Pool() as pool:
        looked = pool.map(look_at, names, chunksize=8)
    sides = {tuple(map(int, name.split("/"))): s for name, _, s, *_ in looked}
    faults = [f"{name}: {fault}" for name, found, *_ in looked for fault in found]
    pairs = 0
    for (z, x, y), mine in sides.items():
        for other, here, there in (((z, (x + 1) % 2 ** (z + 1), y), 2, 0), ((z, x, y + 1), 3, 1)):
            if other in sides:
                pairs += 1
                if mine[here] != sides[other][there]:
                    faults.append(f"{z}/{x}/{y}: crack towards {other[0]}/{other[1]}/{other[2]}")
    posts, exact = sum(l[3] for l in looked), sum(l[4] for l in looked)
    slack = max((l[6] - l[5] for l in looked if l[3]), default=0)
    print(f"{os.path.basename(dem)}: {len(names)} tiles ({exact} say exact), {posts} posts measured, {pairs} shared "
          f"edges, stated - recomputed {slack:.2g} m at most, {len(faults)} disagreements, {time.time() - begin:.0f} s")
    for fault in faults[:10]:
        print("  " + fault)
    return len(names), len(faults) + (len(names) == 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", action="store_true")
    parser.add_argument("paths", nargs="+")
    parser.add_argument("--options", nargs=argparse.REMAINDER, default=[])
    parser.add_argument("--layers", action="store_true", help="the DEMs are layers of one pyramid, the lowest first")
    parser.add_argument("--blend", type=float, default=200, help="metres, of every layer (--layers)")
    parser.add_argument("--geoid", action="store_true", help="the tiles are above the ellipsoid, the DEM above EGM96")
    args = parser.parse_args()
    geoid = Geoid() if args.geoid else None
    datum = ["--from-datum", "egm96", "--to-datum", "ellipsoid"] if geoid else ["--to-datum", "same"]
    results = []
    if args.layers:
        dems = args.paths if args.build else args.paths[1:]
        source = Layers([dem.split(",") for dem in dems], args.blend, geoid)
        if args.build:
            layers = [part for k, dem in enumerate(dems) for part in ("--layer", f"L{k}={dem}")]
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run([os.environ["TIND_BINARY"], "build", *layers, "--blend", str(args.blend), "-o", folder,
                                *datum, "--progress", "none", *args.options], check=True, stdout=subprocess.DEVNULL)
                results.append(check(folder, f"{len(dems)} layers", source))
        else:
            results.append(check(args.paths[0], f"{len(dems)} layers", source))
    elif args.build:
        for dem in args.paths:
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run([os.environ["TIND_BINARY"], "build", dem, "-o", folder, *datum,
                                "--progress", "none", *args.options], check=True, stdout=subprocess.DEVNULL)
                results.append(check(folder, dem, Source(dem, geoid)))
    else:
        results.append(check(*args.paths, Source(args.paths[1], geoid)))
    tiles, faults = (sum(r[k] for r in results) for k in (0, 1))
    print(f"{tiles} tiles, {faults} disagreements")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
