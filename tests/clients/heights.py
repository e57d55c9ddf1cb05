#!/usr/bin/python3
"""Heights of /elevation at 10,000 places, and profiles, against numpy over posts that GDAL read: one
DEM in metres (UTM), one in degrees with voids.

    heights.py      with the program in $TIND_BINARY
"""
import json
import pathlib
import sys
import urllib.request

SKIPPED = 77
try:
    import numpy as np
    from osgeo import gdal
    from web_map import Daemon
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)

gdal.UseExceptions()
ROOT = pathlib.Path(__file__).resolve().parents[2]
PLACES = 10_000
WRONG_M = 1e-3  # heights are floats; answers of converted ones are rounded to millimetres


class Posts:
    def __init__(self, path):
        source = gdal.Open(str(path))
        band = source.GetRasterBand(1)
        self.z = band.ReadAsArray().astype(float)
        if band.GetNoDataValue() is not None:
            self.z[self.z == band.GetNoDataValue()] = np.nan
        self.place = source.GetGeoTransform()
        self.code = source.GetSpatialRef().GetAuthorityCode(None)

    def posts_of(self, x, y):
        return (x - self.place[0]) / self.place[1] - .5, (y - self.place[3]) / self.place[5] - .5

    def places_of(self, column, row):
        return self.place[0] + (column + .5) * self.place[1], self.place[3] + (row + .5) * self.place[5]

    def nearest(self, column, row):
        return self.z[np.floor(row + .5).astype(int), np.floor(column + .5).astype(int)]

    def bilinear(self, column, row):
        """Void where one of the four is: tind has a plane over three, which is asked elsewhere."""
        c, r = np.floor(column).astype(int), np.floor(row).astype(int)
        fx, fy, z = column - c, row - r, self.z
        return ((z[r, c] * (1 - fx) + z[r, c + 1] * fx) * (1 - fy)
                + (z[r + 1, c] * (1 - fx) + z[r + 1, c + 1] * fx) * fy)

    def cubic(self, column, row):
        """Convolution of Keys, a = -1/2, over 4 x 4 posts."""
        c, r = np.floor(column).astype(int), np.floor(row).astype(int)

        def shares(t):
            d = np.abs(np.stack([t + 1, t, 1 - t, 2 - t]))
            return np.where(d <= 1, 1.5 * d**3 - 2.5 * d**2 + 1, -.5 * d**3 + 2.5 * d**2 - 4 * d + 2)

        across, down = shares(column - c), shares(row - r)
        return sum(down[j] * across[i] * self.z[r - 1 + j, c - 1 + i] for j in range(4) for i in range(4))


def heights_of(daemon, name, places, query):
    said = json.loads(daemon.post(f"elevation/{name}?{query}", {"locations": places}))
    return np.array([np.nan if h is None else h for h in said["height_m"]]), said["coverage"]


def check_heights(daemon, name, posts, query=""):
    random = np.random.default_rng(16)
    rows, columns = posts.z.shape
    column, row = random.uniform(2, columns - 3, PLACES), random.uniform(2, rows - 3, PLACES)
    x, y = posts.places_of(column, row)
    column, row = posts.posts_of(x, y)
    for how in ("nearest", "bilinear", "cubic"):
        theirs = getattr(posts, how)(column, row)
        found, coverage = heights_of(daemon, name, np.stack([x, y], axis=1).tolist(), f"{query}&interpolation={how}")
        both = ~np.isnan(theirs)
        assert not np.isnan(found[both]).any(), "no height where all posts have one"
        worst = np.abs(found - theirs)[both].max()
        assert worst < WRONG_M, (name, how, worst)
        if how == "nearest":  # a void is no height, and nothing else is
            assert (np.isnan(found) == np.isnan(theirs)).all()
            assert all((c == "void") == np.isnan(h) for c, h in zip(coverage, found))
        print(f"{name}, {how}: {both.sum()} of {PLACES} places have a height, within {worst:.1e} m of numpy's")


def run_profile(daemon, name, **inputs):
    body = json.dumps({"inputs": {"dataset": name, "format": "json", **inputs}}).encode()
    request = urllib.request.Request(f"http://{daemon.address}/processes/profile/execution", body,
                                     {"Content-Type": "application/json"})
    with urllib.request.urlopen(request) as reply:
        points = json.load(reply)["points"]
    number = [np.nan if p["height_m"] is None else p["height_m"] for p in points]
    return np.array([[p["lon"], p["lat"]] for p in points]), np.array(number)


def check_profiles(daemon, name, posts, lines=20):
    """Of a DEM in degrees: what a profile says of its places is what numpy says; and of a profile
    that has only the places where the surface turns, no place between leaves what its neighbours span."""
    random = np.random.default_rng(4)
    rows, columns = posts.z.shape
    sampled = turns = 0
    worst = beyond = 0.0
    for _ in range(lines):
        ends = np.stack(posts.places_of(random.uniform(2, columns - 3, 2), random.uniform(2, rows - 3, 2)), axis=1)
        places, found = run_profile(daemon, name, line=ends.tolist(), samples=500)
        theirs = posts.bilinear(*posts.posts_of(*places.T))
        both = ~np.isnan(theirs)
        sampled += both.sum()
        worst = max(worst, np.abs(found - theirs)[both].max(initial=0))
        places, found = run_profile(daemon, name, line=ends.tolist())
        turns += len(found)
        for share in (.25, .5, .75):  # straight between neighbours that lie within a post of each other
            z = posts.bilinear(*posts.posts_of(*(places[:-1] * (1 - share) + places[1:] * share).T))
            low, high = np.minimum(found[:-1], found[1:]), np.maximum(found[:-1], found[1:])
            out = np.maximum(low - z, z - high)
            beyond = max(beyond, out[~np.isnan(out)].max(initial=0))
    assert sampled > 1000 and worst < WRONG_M, (sampled, worst)
    assert beyond < 10 * WRONG_M, beyond
    print(f"profiles: {lines} lines, {sampled} samples within {worst:.1e} m of numpy's; {turns} places where the "
          f"surface turns, between which it is at most {beyond:.1e} m beyond them")


def main():
    metres, degrees = ROOT / "testdata/bigtujunga_crop.tif", ROOT / "testdata/rainier.tif"
    daemon = Daemon([metres, degrees])
    try:
        posts = Posts(metres)
        check_heights(daemon, "bigtujunga_crop", posts, f"crs=EPSG:{posts.code}")
        posts = Posts(degrees)
        check_heights(daemon, "rainier", posts)
        check_profiles(daemon, "rainier", posts)
    finally:
        daemon.stop()


main()
