#!/usr/bin/python3
"""Scripts as the documents of other services have them, and clients made for these, against the
daemon: only the address is another. What is not installed is skipped.

    existing_clients.py      with the program in $TIND_BINARY
"""
import io
import os
import pathlib
import sys
import tempfile
import unittest
import urllib.parse

SKIPPED = 77
try:
    import numpy as np
    import requests
    from web_map import Daemon
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEM = ROOT / "testdata/rainier.tif"
SUMMIT = (46.85, -121.76)  # latitude first, as these services have it
SUMMIT_M = 4317.0
NOWHERE = (0.0, 0.0)


class Served(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon([DEM])
        cls.url = f"http://{cls.daemon.address}"

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()


class OpenTopoData(Served):
    """Of its pages "API documentation" and "Calling from the browser / Python"."""

    def test_a_query(self):
        response = requests.get(f"{self.url}/v1/rainier?locations=46.85,-121.76&interpolation=cubic")
        said = response.json()
        self.assertEqual(said["status"], "OK")
        [result] = said["results"]
        self.assertEqual(set(result), {"elevation", "location", "dataset"})
        self.assertEqual(result["location"], {"lat": SUMMIT[0], "lng": SUMMIT[1]})
        self.assertAlmostEqual(result["elevation"], SUMMIT_M, delta=30)

    def test_a_post_of_json_and_of_a_form(self):
        data = {"locations": "46.85,-121.76|0,0", "interpolation": "bilinear"}
        for how in ({"json": data}, {"data": data}):
            results = requests.post(f"{self.url}/v1/rainier", **how).json()["results"]
            self.assertEqual([r["elevation"] for r in results], [SUMMIT_M, None])

    def test_what_is_wrong(self):
        response = requests.get(f"{self.url}/v1/rainier?locations=46.85")
        self.assertEqual((response.status_code, response.json()["status"]), (400, "INVALID_REQUEST"))


class OpenElevation(Served):
    """Of its "API docs": curl's GET and POST."""

    def test_both(self):
        get = requests.get(f"{self.url}/api/v1/lookup", params={"locations": "46.85,-121.76|0,0"})
        post = requests.post(f"{self.url}/api/v1/lookup", headers={"Accept": "application/json"}, json={
            "locations": [{"latitude": lat, "longitude": lon} for lat, lon in (SUMMIT, NOWHERE)]})
        for response in (get, post):
            results = response.json()["results"]
            self.assertEqual([r["elevation"] for r in results], [SUMMIT_M, None])
            self.assertEqual((results[0]["latitude"], results[0]["longitude"]), SUMMIT)


class Valhalla(Served):
    """Of its page "Elevation service API reference"."""

    SHAPE = [{"lat": 46.80, "lon": -121.80}, {"lat": 46.85, "lon": -121.76}, {"lat": 46.90, "lon": -121.72}]

    def test_heights_and_ranges(self):
        said = requests.post(f"{self.url}/height", json={"range": True, "shape": self.SHAPE}).json()
        self.assertEqual(len(said["range_height"]), 3)
        self.assertEqual(said["range_height"][0][0], 0)
        self.assertAlmostEqual(said["range_height"][1][1], SUMMIT_M, delta=1)
        said = requests.post(f"{self.url}/height", json={"range": False, "shape": self.SHAPE}).json()
        self.assertEqual(len(said["height"]), 3)

    def test_resampled_and_with_an_id(self):
        said = requests.post(f"{self.url}/height", json={"shape": self.SHAPE, "resample_distance": 500, "range": True,
                                                         "id": "Rainier", "height_precision": 2}).json()
        self.assertEqual(said["id"], "Rainier")
        self.assertGreater(len(said["range_height"]), 20)


class OsmnxAsIs(Served):
    def test_nodes_of_a_graph_get_their_heights(self):
        try:
            import networkx
            import osmnx
        except ImportError as error:
            self.skipTest(str(error))
        graph = networkx.MultiDiGraph(crs="EPSG:4326")
        random = np.random.default_rng(3)
        for node in range(1000):
            graph.add_node(node, x=float(random.uniform(-121.9, -121.65)), y=float(random.uniform(46.75, 46.95)))
        for node in range(999):
            graph.add_edge(node, node + 1, 0, length=100.0)
        osmnx.settings.use_cache = False
        ask, url = requests.get, self.url

        def elsewhere(address, **options):  # the only thing that is another: whose it is
            return ask(address.replace("https://maps.googleapis.com", url), **options)

        osmnx.elevation.requests.get = elsewhere
        try:
            graph = osmnx.elevation.add_node_elevations_google(graph, api_key="any")
        finally:
            osmnx.elevation.requests.get = ask
        graph = osmnx.elevation.add_edge_grades(graph)
        at = requests.post(f"{url}/elevation/rainier", json={
            "locations": [[round(d["x"], 5), round(d["y"], 5)] for _, d in graph.nodes(data=True)]}).json()["height_m"]
        for (_, data), height in zip(graph.nodes(data=True), at):
            if height is not None:
                self.assertAlmostEqual(data["elevation"], height, delta=1e-3)
        self.assertEqual(len(graph.edges), 999)


class OwsLib(Served):
    """Which knows Common, Coverages and Processes."""

    def setUp(self):
        try:
            import owslib.ogcapi.coverages
            import owslib.ogcapi.processes
        except ImportError as error:
            self.skipTest(str(error))

    def test_coverages(self):
        from owslib.ogcapi.coverages import Coverages
        client = Coverages(self.url)
        self.assertEqual(client.coverages(), ["rainier"])
        self.assertEqual(client.collection("rainier")["id"], "rainier")
        self.assertIn("http://www.opengis.net/spec/ogcapi-common-1/1.0/conf/core", client.conformance()["conformsTo"])
        bytes_ = client.coverage("rainier")
        self.assertTrue(isinstance(bytes_, io.BytesIO) and bytes_.read(3) == b"II*")

    def test_processes(self):
        from owslib.ogcapi.processes import Processes
        client = Processes(self.url)
        self.assertIn("viewshed", [one["id"] for one in client.processes()["processes"]])
        self.assertIn("max_error", client.process("simplify")["inputs"])

    def test_its_document(self):
        from owslib.ogcapi import API
        kinds = [link["type"] for link in API(self.url).links if link["rel"] == "service-desc"]
        self.assertTrue(kinds)


class Qgis(Served):
    """Its rasters: the coverage by OGC API, tiles of web maps. (Version 3.22 knows no EDR; its reader of
    Features is for features, of which terrain has none.)"""

    def setUp(self):
        try:
            from qgis.core import QgsApplication
        except ImportError as error:
            self.skipTest(str(error))
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.environ["HOME"] = folder.name  # where QGIS keeps what it is set to
        os.chdir(folder.name)  # and GDAL's driver what it has fetched
        self.application = QgsApplication([], False)
        self.application.initQgis()

    def test_the_coverage_and_tiles(self):
        from qgis.core import QgsCoordinateReferenceSystem, QgsCoordinateTransform, QgsPointXY, QgsProject, QgsRasterLayer, QgsRectangle
        lat, lon = SUMMIT
        coverage = QgsRasterLayer(f"OGCAPI:{self.url}/collections/rainier", "coverage", "gdal")
        self.assertTrue(coverage.isValid())
        self.assertEqual((coverage.width(), coverage.height(), coverage.crs().authid()), (577, 481, "EPSG:4326"))
        self.assertEqual(coverage.dataProvider().sample(QgsPointXY(lon, lat), 1), (SUMMIT_M, True))

        address = urllib.parse.quote(f"{self.url}/shade/rainier/{{z}}/{{x}}/{{y}}.png", safe="")
        tiles = QgsRasterLayer(f"type=xyz&zmin=0&zmax=8&url={address}", "tiles", "wms")
        self.assertTrue(tiles.isValid())
        to_map = QgsCoordinateTransform(QgsCoordinateReferenceSystem("EPSG:4326"), tiles.crs(), QgsProject.instance())
        at = to_map.transform(QgsPointXY(lon, lat))
        around = QgsRectangle(at.x() - 9000, at.y() - 9000, at.x() + 9000, at.y() + 9000)
        block = tiles.dataProvider().block(1, around, 64, 64)
        colours = {block.color(row, column) for row in range(64) for column in range(64)}
        self.assertGreater(len(colours), 20)  # a mountain with its shades, not an empty picture


if __name__ == "__main__":
    unittest.main()
