#!/usr/bin/python3
"""Meshes as tind writes them, read back by other people's programs.

    mesh_formats.py gdal|assimp|meshio|netcdf|qgis      with the program in $TIND_BINARY

Every reader must find the vertices and triangles of the same mesh's PLY, which is parsed here:
bit by bit where the format holds doubles. Exit code 77: the reader is not installed.
"""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

from figure import figure

SKIPPED = 77
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEM = ROOT / "testdata/bigtujunga_crop.tif"      # UTM zone 11, whole metres
DEGREES = ROOT / "testdata/rainier.tif"


def skip(reader, why):
    print(f"skipped: {reader} is not installed ({why})")
    sys.exit(SKIPPED)


try:
    import numpy as np
except ImportError as error:
    skip("numpy", error)


def tind(*arguments):
    ran = subprocess.run([os.environ["TIND_BINARY"], *map(str, arguments)], capture_output=True, text=True)
    assert ran.returncode == 0, (arguments, ran.stderr)
    return ran.stdout


def simplify(path, *options, dem=DEM):
    return json.loads(tind("simplify", dem, "--ratio", "0.02", "--json", "-o", path, *options))


def read_ply(path):
    """tind's own PLY: vertices as doubles, a colour where there is one, triangles."""
    data = pathlib.Path(path).read_bytes()
    end = data.index(b"end_header\n") + 11
    header = data[:end].decode().splitlines()
    count = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element")}
    colours = any(line.endswith(" red") for line in header)
    vertex = np.dtype([("p", "<f8", 3)] + ([("c", "u1", 3)] if colours else []))
    face = np.dtype([("n", "u1"), ("i", "<u4", 3)])
    v = np.frombuffer(data, vertex, count["vertex"], end)
    f = np.frombuffer(data, face, count["face"], end + v.nbytes)
    return v["p"], f["i"], header


def corners(positions, triangles):
    """Triangles by their corners, each beginning with its smallest: equal for equal surfaces."""
    t = np.asarray(positions, float)[np.asarray(triangles, int)]
    first = [min(range(3), key=lambda k: tuple(c[k])) for c in t]
    return sorted(tuple(map(tuple, np.roll(c, -k, axis=0))) for c, k in zip(t, first))


def same(found, expected, what):
    assert len(found) == len(expected), (what, len(found), len(expected))
    assert found == expected, (what, next((a, b) for a, b in zip(found, expected) if a != b))


def close(found, expected, most, what):
    """The same vertices in the same order, but for rounding."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    assert found.shape == expected.shape, (what, found.shape, expected.shape)
    off = np.abs(found - expected).max()
    assert off <= most, (what, off)
    return off


# ---- GDAL: GeoPackage, FlatGeobuf, DXF, rasters ----

def gdal_triangles(path):
    from osgeo import ogr
    source = ogr.Open(str(path))    # a layer does not keep its file open
    layer = source.GetLayer(0)
    found = []
    for feature in layer:
        ring = feature.GetGeometryRef()
        ring = ring.GetGeometryRef(0) if ring.GetGeometryCount() else ring
        points = ring.GetPoints()
        assert len(points) in (4, 5), points
        found.append(points[:3])
    crs = layer.GetSpatialRef()
    flat = np.array(found).reshape(-1, 3)
    return corners(flat, np.arange(len(flat)).reshape(-1, 3)), crs.GetAuthorityCode(None) if crs else None


def with_gdal(folder):
    try:
        from osgeo import gdal, ogr
    except ImportError as error:
        skip("python3-gdal", error)
    gdal.UseExceptions()
    gdal.PushErrorHandler("CPLQuietErrorHandler")    # GDAL warns of the rings that it makes of 3DFACEs itself
    for dem, code in ((DEM, "32611"), (DEGREES, "4326")):
        simplify(folder / "a.ply", dem=dem)
        positions, triangles, _ = read_ply(folder / "a.ply")
        expected = corners(positions, triangles)
        for extension in ("gpkg", "fgb", "dxf"):
            path = folder / f"a.{extension}"
            simplify(path, dem=dem)
            found, crs = gdal_triangles(path)
            same(found, expected, path.name)
            assert extension == "dxf" or crs == code, (path.name, crs)
            before = path.read_bytes()
            simplify(path, dem=dem)
            assert path.read_bytes() == before, "the same mesh is the same bytes"
            figure(f"GDAL {gdal.__version__}", f"{path.suffix[1:]}: {len(found)} triangles, every bit of their coordinates, CRS {crs}")


# ---- assimp: PLY, OBJ, STL, GLB ----

def read_glb(path):
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    gltf, numbers = json.loads(data[20:20 + size]), data[28 + size:]

    def array(accessor):
        a = gltf["accessors"][accessor]
        view = gltf["bufferViews"][a["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "u1"}[a["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[a["type"]]
        start = view.get("byteOffset", 0) + a.get("byteOffset", 0)
        return np.frombuffer(numbers, kind, a["count"] * width, start).reshape(-1, width)

    primitive = gltf["meshes"][0]["primitives"][0]
    attributes = {name: array(accessor) for name, accessor in primitive["attributes"].items()}
    return attributes, array(primitive["indices"]).reshape(-1, 3), gltf


def with_assimp(folder):
    if not shutil.which("assimp"):
        skip("assimp-utils", "no program assimp")

    def load(path):
        """What assimp makes of a file, written by it as GLB, which does not change a float."""
        out = folder / "assimp.glb"
        ran = subprocess.run(["assimp", "export", path, out, "-fglb2"], capture_output=True, text=True)
        assert ran.returncode == 0 and out.exists(), (path.name, ran.stdout + ran.stderr)
        attributes, faces, _ = read_glb(out)
        out.unlink()
        return attributes["POSITION"].astype(float), faces, attributes.get("COLOR_0")

    def unordered(positions, triangles):
        return corners(np.round(positions, 6), triangles)

    simplify(folder / "a.ply", "--frame", "metric", "--method", "greedy")
    positions, triangles, _ = read_ply(folder / "a.ply")
    for extension in ("ply", "obj", "stl"):
        path = folder / f"a.{extension}"
        simplify(path, "--frame", "metric", "--method", "greedy")
        found, faces, _ = load(path)
        assert len(faces) == len(triangles), (path.name, len(faces))
        assert extension == "stl" or len(found) == len(positions), (path.name, len(found))    # STL shares none
        same(unordered(found, faces), unordered(positions.astype(np.float32).astype(float), triangles), path.name)
        figure("assimp", f"{extension}: {len(faces)} triangles, every vertex as float32")

    for frame in ("source", "metric"):
        simplify(folder / "a.ply", "--frame", frame, "--method", "greedy")
        positions, triangles, _ = read_ply(folder / "a.ply")
        path = folder / "a.glb"
        simplify(path, "--frame", frame, "--method", "greedy")
        found, faces, _ = load(path)
        matrix = np.array(read_glb(path)[2]["nodes"][0]["matrix"], float).reshape(4, 4).T    # assimp keeps it as float32
        x, y, z = (matrix @ np.c_[found, np.ones(len(found))].T)[:3]
        placed = np.c_[x, -z, y]
        off = np.abs(np.sort(placed, axis=0) - np.sort(positions, axis=0)).max()
        assert off < 1e-9, off                 # vertices on posts: not one digit is lost
        same(unordered(placed, faces), unordered(positions, triangles), f"glb, {frame}")
        figure("assimp", f"glb, {frame}: {len(faces)} triangles, at most {off:.1e} off in double")

    picture = ROOT / "testdata/rainier.tif"    # any image serves as colours
    drape = ("--method", "attribute-qem", "--attributes", "colour", "--drape", picture)
    simplify(folder / "c.ply", *drape, dem=DEGREES)
    positions, _, header = read_ply(folder / "c.ply")
    assert any(line.endswith(" red") for line in header)
    simplify(folder / "c.glb", *drape, dem=DEGREES)
    found, faces, colours = load(folder / "c.glb")
    assert colours is not None and len(colours) == len(found) and colours[:, :3].max() > colours[:, :3].min()
    figure("assimp", f"glb: {len(found)} vertices with COLOR_0")


# ---- meshio: VTU ----

def with_meshio(folder):
    try:
        import meshio
    except ImportError as error:
        skip("python3-meshio", error)
    simplify(folder / "a.ply")
    positions, triangles, _ = read_ply(folder / "a.ply")
    simplify(folder / "a.vtu")
    mesh = meshio.read(folder / "a.vtu")
    assert np.array_equal(mesh.points, positions)
    assert [c.type for c in mesh.cells] == ["triangle"] and np.array_equal(mesh.cells[0].data, triangles)
    figure(f"meshio {meshio.__version__}", f"vtu: {len(triangles)} triangles, bit by bit")
    mesh = meshio.read(folder / "a.ply")
    assert np.array_equal(mesh.points, positions) and np.array_equal(mesh.cells[0].data, triangles)
    figure(f"meshio {meshio.__version__}", f"ply: {len(triangles)} triangles, bit by bit")


# ---- netCDF4: UGRID ----

def with_netcdf(folder):
    try:
        import netCDF4
    except ImportError as error:
        skip("python3-netcdf4", error)
    for dem, code, standard_name in ((DEM, 32611, "projection_x_coordinate"), (DEGREES, 4326, "longitude")):
        simplify(folder / "a.ply", dem=dem)
        positions, triangles, _ = read_ply(folder / "a.ply")
        simplify(folder / "a.nc", dem=dem)
        with netCDF4.Dataset(folder / "a.nc") as file:
            topology = file.get_variables_by_attributes(cf_role="mesh_topology")[0]
            assert topology.topology_dimension == 2
            x, y = (file[name] for name in topology.node_coordinates.split())
            z = file.get_variables_by_attributes(standard_name="altitude")[0]
            faces = file[topology.face_node_connectivity]
            assert np.array_equal(np.c_[x[:], y[:], z[:]], positions)
            assert np.array_equal(faces[:] - faces.start_index, triangles)
            assert x.standard_name == standard_name and z.location == "node"
            assert file[x.grid_mapping].epsg == code and z.grid_mapping == x.grid_mapping
            assert (z.units, z.positive, z.coordinates) == ("m", "up", topology.node_coordinates)
            assert x.units == ("degrees_east" if code == 4326 else "m")
            assert code != 4326 or file[x.grid_mapping].grid_mapping_name == "latitude_longitude"
            named = [name for name in file.variables if name != x.grid_mapping]
            assert all(file[name].long_name for name in named), named
        figure(f"netCDF4 {netCDF4.__version__}", f"UGRID: {len(triangles)} triangles, bit by bit, EPSG:{code}")


# ---- QGIS, whose MDAL reads PLY, 2DM, UGRID ----

def with_qgis(folder):
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ["HOME"] = str(folder)  # where QGIS keeps what it is set to
    try:
        from qgis.core import Qgis, QgsApplication, QgsMesh, QgsMeshLayer
    except ImportError:
        skip("QGIS", "Debian: python3-qgis")
    QgsApplication.setPrefixPath("/usr", True)
    application = QgsApplication([], False)
    application.initQgis()

    def load(path):
        layer = QgsMeshLayer(str(path), "a", "mdal")
        assert layer.isValid(), (path, layer.error().message())
        mesh = QgsMesh()
        layer.dataProvider().populateMesh(mesh)
        points = [mesh.vertex(i) for i in range(mesh.vertexCount())]
        faces = [mesh.face(i) for i in range(mesh.faceCount())]
        return np.array([(p.x(), p.y(), p.z()) for p in points]), np.array(faces), layer.crs().authid()

    for dem, code in ((DEM, "EPSG:32611"), (DEGREES, "EPSG:4326")):
        simplify(folder / "a.ply", dem=dem)
        positions, triangles, _ = read_ply(folder / "a.ply")
        for extension, crs in (("ply", code), ("nc", code), ("2dm", "")):
            path = folder / f"a.{extension}"
            simplify(path, dem=dem)
            found, faces, projection = load(path)
            assert np.array_equal(faces, triangles), path.name
            close(found, positions, 0, path.name)
            assert projection == crs, (path.name, projection)
            figure(f"QGIS {Qgis.version().split('-')[0]} with MDAL", f"{extension}: {len(faces)} triangles, bit by bit, CRS '{projection}'")
    application.exitQgis()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        {"gdal": with_gdal, "assimp": with_assimp, "meshio": with_meshio, "netcdf": with_netcdf,
         "qgis": with_qgis}[sys.argv[1]](pathlib.Path(temporary))
