"""Hostile files of lines and polygons: shapefiles, GeoPackages, GeoJSON and others, as breaklines, lakes and boundary."""
import json
import sqlite3
import struct

from common import figures, programme
from common.hostile import Case, Judge
from common.tiff import tiff
from common.work import heights

TIERS = ("ci", "gate", "campaign")
ASKED = "D6, for vectors: 0 files outside opened, 512 MB and bounded time each, refused or sound"
WHY_NOT = "`tind build` reads them, as the daemon does where its configuration names some; for most cases, those cut included, any tiles pass that the file may now say; a bit in a coordinate is another coordinate: for flips only the end, memory, time and files are judged"

RING = [(8.01, 46.97), (8.03, 46.97), (8.03, 46.99), (8.01, 46.99), (8.01, 46.97)]
WKT = ('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
       'UNIT["degree",0.0174532925199433]]')


def REACHED(rows):
    last = figures.last_whole(rows)
    return {"D6": f"vectors: {last.tried:,} cases in the last row, {last.wrong} wrong; {sum(row.tried for row in rows):,} in all"}


def shapefile(rings=(RING,), kind=5, points=None, parts=None, length=None):
    flat = [p for ring in rings for p in ring]
    starts, at = [], 0
    for ring in rings:
        starts.append(at)
        at += len(ring)
    xs, ys = [p[0] for p in flat], [p[1] for p in flat]
    box = struct.pack("<4d", min(xs), min(ys), max(xs), max(ys))
    content = (struct.pack("<i", kind) + box + struct.pack("<ii", len(starts) if parts is None else parts, len(flat) if points is None else points)
               + b"".join(struct.pack("<i", s) for s in starts) + b"".join(struct.pack("<2d", *p) for p in flat))
    words = len(content) // 2 if length is None else length
    record = struct.pack(">ii", 1, words) + content

    def head(size):
        return struct.pack(">7i", 9994, 0, 0, 0, 0, 0, size // 2) + struct.pack("<ii", 1000, kind) + box + bytes(32)
    dbf = struct.pack("<BBBBIHH20x", 3, 26, 1, 1, 1, 65, 11) + struct.pack("<11sc4xBB14x", b"ID", b"N", 10, 0) + b"\r" + b" " + b"1".rjust(10) + b"\x1a"
    return {"a.shp": head(100 + len(record)) + record, "a.shx": head(108) + struct.pack(">ii", 50, words), "a.dbf": dbf, "a.prj": WKT.encode()}


def geometry(ring=RING):
    return b"GP\0\x01" + struct.pack("<i", 4326) + struct.pack("<BII I", 1, 3, 1, len(ring)) + b"".join(struct.pack("<2d", *p) for p in ring)


def geopackage(work, blob=None, more=()):
    path = work / "made.gpkg"
    path.unlink(missing_ok=True)
    base = sqlite3.connect(path)
    base.executescript("""PRAGMA application_id=1196444487; PRAGMA user_version=10300;
CREATE TABLE gpkg_spatial_ref_sys(srs_name TEXT,srs_id INTEGER PRIMARY KEY,organization TEXT,organization_coordsys_id INTEGER,definition TEXT,description TEXT);
CREATE TABLE gpkg_contents(table_name TEXT PRIMARY KEY,data_type TEXT,identifier TEXT,description TEXT,last_change TEXT,min_x DOUBLE,min_y DOUBLE,max_x DOUBLE,max_y DOUBLE,srs_id INTEGER);
CREATE TABLE gpkg_geometry_columns(table_name TEXT,column_name TEXT,geometry_type_name TEXT,srs_id INTEGER,z TINYINT,m TINYINT);
CREATE TABLE lakes(fid INTEGER PRIMARY KEY,geom BLOB);
INSERT INTO gpkg_contents VALUES('lakes','features','lakes','','2024-01-01T00:00:00Z',8,46,9,47,4326);
INSERT INTO gpkg_geometry_columns VALUES('lakes','geom','POLYGON',4326,0,0);""")
    base.execute("INSERT INTO gpkg_spatial_ref_sys VALUES('WGS 84',4326,'EPSG',4326,?,'')", (WKT,))
    base.execute("INSERT INTO lakes VALUES(1,?)", (geometry() if blob is None else blob,))
    for statement in more:
        base.execute(statement)
    base.commit()
    base.close()
    return path.read_bytes()


def geojson(rings=(RING,), kind="Polygon", **more):
    return json.dumps({"type": "FeatureCollection", **more, "features": [{"type": "Feature", "properties": {},
                      "geometry": {"type": kind, "coordinates": [list(map(list, ring)) for ring in rings]}}]}).encode()


def made(run):
    nan = float("nan")
    yield "a shapefile", shapefile(), "sound"
    for name, more in (("2^31 points", {"points": 2**31 - 1}), ("-1 points", {"points": -1}), ("2^31 parts", {"parts": 2**31 - 1}), ("-1 parts", {"parts": -1}),
                       ("a length of 2^31", {"length": 2**31 - 1}), ("a length of 0", {"length": 0}), ("a kind of 31", {"kind": 31}), ("a kind of 99", {"kind": 99}),
                       ("NaN", {"rings": ([(nan, nan)] * 5,)}), ("1e308", {"rings": ([(1e308, -1e308), (-1e308, 1e308), (1e308, 1e308), (1e308, -1e308)],)}),
                       ("one point", {"rings": ([(8.01, 46.97)],)}), ("10,000 rings", {"rings": (RING,) * 10000}), ("50,000 points that cross", {"rings": ([(8 + (i * 7919 % 5000) / 1e5, 46.95 + (i * 104729 % 5000) / 1e5) for i in range(3000)],)})):
        yield f"a shapefile with {name}", shapefile(**more), "bounded"
    for name in ("a.shx", "a.dbf", "a.prj"):
        files = shapefile()
        yield f"a shapefile without {name}", {k: v for k, v in files.items() if k != name}, "bounded"
        yield f"a shapefile with an empty {name}", {**files, name: b""}, "bounded"
    grids = WKT.replace(']],PRIMEM', '],EXTENSION["PROJ4_GRIDS","{far}/secret.gsb"]],PRIMEM')
    yield "a shapefile whose CRS names a grid", {**shapefile(), "a.prj": grids}, "refused"
    package = geopackage(run.work)
    yield "a GeoPackage", {"a.gpkg": package}, "sound"
    for name, blob in (("an empty geometry", b""), ("a geometry of 2^32 - 1 points", geometry()[:17] + b"\xff" * 4 + geometry()[21:]), ("noise", bytes(range(256))), ("a text", b"POLYGON EMPTY"),
                       ("collections in each other", b"GP\0\x01" + struct.pack("<i", 4326) + struct.pack("<BII", 1, 7, 1) * 3000)):
        yield f"a GeoPackage with {name}", {"a.gpkg": geopackage(run.work, blob)}, "bounded"
    for name, statement in (("a view of itself", "CREATE VIEW v AS SELECT * FROM v"), ("a trigger that attaches", "CREATE TRIGGER t AFTER INSERT ON lakes BEGIN SELECT load_extension('/tmp/x'); END"),
                            ("a view that never ends", "CREATE VIEW w AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x+1 FROM c) SELECT x AS fid, x AS geom FROM c"),
                            ("a definition that names a grid", "UPDATE gpkg_spatial_ref_sys SET definition='" + grids.replace("{far}", "/etc") + "'"),
                            ("an extension", "CREATE TABLE gpkg_extensions(table_name TEXT,column_name TEXT,extension_name TEXT,definition TEXT,scope TEXT)")):
        yield f"a GeoPackage with {name}", {"a.gpkg": geopackage(run.work, more=(statement,))}, "bounded"
    yield "GeoJSON", {"a.geojson": geojson()}, "sound"
    for name, data in (("a CRS that is a link", geojson(crs={"type": "link", "properties": {"href": "http://127.0.0.1:18099/crs", "type": "proj4"}})),
                       ("a CRS that is a file", geojson(crs={"type": "name", "properties": {"name": "/etc/passwd"}})), ("nothing", b""), ("null", b"null"), ("an array 100,000 deep", b"[" * 100000),
                       ("coordinates 100,000 deep", geojson().replace(b"[[[", b"[" * 100000)), ("texts for numbers", geojson().replace(b"8.01", b'"8.01"')), ("1e999", geojson().replace(b"8.01", b"1e999")),
                       ("NaN", geojson().replace(b"8.01", b"NaN")), ("300,000 points", geojson([[(8 + i * 1e-7, 46.95 + (i % 2) * 1e-3) for i in range(300000)]])),
                       ("a ring of one point", geojson([[(8.01, 46.97)]])), ("no rings", geojson([])), ("a key of 8 MB", geojson().replace(b"properties", b"p" * 8000000))):
        yield f"GeoJSON with {name}", {"a.geojson": data}, "bounded"
    gml = '<gml:FeatureCollection xmlns:gml="http://www.opengis.net/gml" xmlns:xlink="http://www.w3.org/1999/xlink"><gml:featureMember><a><gml:geometryProperty {}/></a></gml:featureMember></gml:FeatureCollection>'
    yield "GML with a link", {"a.gml": gml.format('xlink:href="{far}/secret.gsb#a"')}, "bounded"
    yield "GML with a URL", {"a.gml": gml.format('xlink:href="http://127.0.0.1:18099/#a"')}, "bounded"
    entity = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY x SYSTEM "file://{far}/secret.gsb">]>'
    yield "GML with an entity", {"a.gml": entity + gml.format("").replace("<a>", "<a>&x;")}, "bounded"
    kml = '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><NetworkLink><Link><href>http://127.0.0.1:18099/</href></Link></NetworkLink>{}</Document></kml>'
    yield "KML with a network link", {"a.kml": kml.format("")}, "bounded"
    yield "KML with an entity", {"a.kml": entity + kml.format("&x;")}, "bounded"
    yield "a VRT of vectors", {"a.vrt": '<OGRVRTDataSource><OGRVRTLayer name="a"><SrcDataSource>{far}/secret.gsb</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>'}, "refused"
    for ending in ("shp", "gpkg", "geojson", "fgb", "tab", "dxf", "csv", "gpx", "kml", "gml", "sqlite", "json"):
        yield f"a VRT called .{ending}", {f"a.{ending}": '<OGRVRTDataSource><OGRVRTLayer name="a"><SrcDataSource>{far}/secret.gsb</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>'}, "refused"
        yield f"noise called .{ending}", {f"a.{ending}": run.rng.randbytes(3000)}, "bounded"
        yield f"nothing called .{ending}", {f"a.{ending}": b""}, "bounded"
    for name, files in (("shapefile", shapefile()), ("GeoPackage", {"a.gpkg": package}), ("GeoJSON", {"a.geojson": geojson()})):
        first, data = next(iter(files.items()))
        rest = {k: v for k, v in files.items() if k != first}
        for i in range(50):
            yield f"a {name} cut at {i}/50", {first: data[:len(data) * i // 50], **rest}, "bounded"
        for _ in range(30):
            at = run.rng.randrange(min(len(data), 6000))
            yield f"a {name} with byte {at} changed", {first: data[:at] + bytes([data[at] ^ 1 << run.rng.randrange(8)]) + data[at + 1:], **rest}, "bounded"


def run(run):
    programme.needs("strace")
    dem = run.work / "dem.tif"
    dem.write_bytes(tiff(heights(), compress=8))
    judge = Judge(run, {"lake": ["--levels", "0-9"]})
    whole = run.work / "lake.geojson"
    whole.write_bytes(geojson())
    judge.reference("lake", dem, ["--flatten", whole])
    cases = []
    for i, (name, files, verdict) in enumerate(made(run)):
        option = ("--flatten", "--water", "--breaklines", "--boundary")[i % 4 if verdict == "bounded" else 0]
        cases.append(Case(f"{name} as {option[2:]}", files, "same" if verdict == "sound" else verdict, [str(dem), option, "{0}"], "lake", far={"secret.gsb": b"x" * 999}))
    judge.shared = (str(dem)[:-3],)  # and what may lie beside it
    chosen = run.sample(cases, 0.1)
    for case in chosen:
        if run.time_left() < 0 and run.tier != "gate":
            break
        judge.try_case(case)
    run.note(f"{len(cases)} cases, {judge.built} built, the others refused; at most {judge.peak:.0f} MB, {judge.cpu:.1f} s of CPU")
