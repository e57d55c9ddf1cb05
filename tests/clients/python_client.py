#!/usr/bin/env python3
"""The Python client (scripts/python/tind) against a server and against the local program: heights
one by one and by the hundred thousand, the same mesh both ways, errors, jobs.

    python_client.py      with the program in $TIND_BINARY
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import unittest
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace

os.environ.setdefault("TIND_AS_ROOT", "true")  # at work here alone, maybe where there is no other user
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "scripts/python"))
import tind  # noqa: E402

DEM = ROOT / "testdata/rainier.tif"
PROGRAM = os.environ["TIND_BINARY"]
BOX = (-121.8, 46.8, -121.7, 46.9)


class Served(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = subprocess.Popen([PROGRAM, "serve", str(DEM), "--listen", "127.0.0.1:0"],
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for line in cls.server.stdout:
            if found := re.search(r"at (http://[^/\s]+)", line):
                cls.url = found[1]
                break
        cls.client = tind.Client(cls.url)
        cls.program = tind.Program(PROGRAM)

    @classmethod
    def tearDownClass(cls):
        cls.server.terminate()
        cls.server.wait()
        cls.server.stdout.close()

    def test_a_height_is_a_number_or_none(self):
        height = self.client.elevation("rainier", -121.76, 46.85)
        self.assertAlmostEqual(height.height_m, 4317, delta=1)
        self.assertEqual((height.coverage, height.datum), ("value", "egm96"))
        self.assertIsNone(self.client.elevation("rainier", 0, 0).height_m)
        seen = self.client.elevation("rainier", -121.76, 46.85, level=12)
        self.assertGreater(seen.max_error_m, 0)
        height = self.client.elevation("rainier", -121.76, 46.85, datum=seen.datum)
        self.assertTrue(seen.low_m <= height.height_m <= seen.high_m)
        many = self.client.elevations("rainier", [(-121.76, 46.85), (0, 0)], level=12)
        self.assertEqual((many.low_m, many.high_m), ([seen.low_m, None], [seen.high_m, None]))

    def test_many_are_asked_in_parts_and_come_in_order(self):
        places = [(-121.9 + 0.2 * i / 150_000, 46.85) for i in range(150_000)]
        heights = self.client.elevations("rainier", places)
        self.assertEqual(len(heights), len(places))
        for i in (0, 99_999, 100_000, 149_999):
            one = self.client.elevation("rainier", *places[i])
            self.assertEqual((heights[i], heights.coverage[i]), (one.height_m, one.coverage))

    def test_points_of_frames_are_asked_in_their_own_system(self):
        for code, first, x, y in ((32610, "east", 594_538.0, 5_189_400.0),
                                  (4269, "north", -121.76, 46.85)):
            axis = SimpleNamespace(direction=first)
            crs = SimpleNamespace(to_epsg=lambda code=code: code, axis_info=[axis])
            points = SimpleNamespace(crs=crs, x=[x], y=[y])  # as geopandas has them
            self.assertGreater(self.client.elevations("rainier", points)[0], 4000)

    def test_a_mesh_is_the_same_served_and_made_here(self):
        served = self.client.simplify("rainier", bbox=BOX, max_error=5)
        local = self.program.simplify(DEM, bbox=BOX, max_error=5)
        self.assertEqual(served.bytes(), local.bytes())
        self.assertEqual(served.report["triangles"], local.report["triangles"])
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mesh.ply"
            served.save(path)
            self.assertEqual(path.read_bytes(), local.bytes())
            self.assertEqual(os.listdir(folder), ["mesh.ply"])

    def test_a_raster_is_the_same_served_and_made_here(self):
        served = self.client.hillshade("rainier", azimuth=300, bbox=BOX)
        self.assertEqual(served.bytes(), self.program.hillshade(DEM, azimuth=300, bbox=BOX).bytes())

    def test_heights_are_the_same_served_and_made_here(self):
        places = [(-121.9 + 0.01 * i, 46.7 + 0.007 * i) for i in range(60)]
        served, local = self.client.elevations("rainier", places), self.program.elevations(DEM, places)
        self.assertEqual((served.coverage, served.datum), (local.coverage, local.datum))
        for of_server, of_program in zip(served, local):  # a server rounds what nobody measures
            if of_server is None:
                self.assertIsNone(of_program)
            else:
                self.assertAlmostEqual(of_server, of_program, delta=1e-3)

    def test_questions_have_the_same_answers_served_and_made_here(self):
        line = [(-121.8, 46.8), (-121.72, 46.88)]
        square = {"type": "Polygon", "coordinates": [[[-121.8, 46.8], [-121.7, 46.8], [-121.7, 46.9],
                                                      [-121.8, 46.9], [-121.8, 46.8]]]}
        for ask in (lambda t, dem: t.profile(dem, line),
                    lambda t, dem: t.profile(dem, line, samples=50, format="geojson"),
                    lambda t, dem: t.viewshed(dem, line[0], radius=3000, uncertainty=2),
                    lambda t, dem: t.relief(dem, bbox=BOX),
                    lambda t, dem: t.statistics(dem, square)):
            self.assertEqual(ask(self.client, "rainier").bytes(), ask(self.program, DEM).bytes())
        for ask in (lambda t, dem: t.line_of_sight(dem, *line, from_height=30, uncertainty=5),
                    lambda t, dem: t.volume(dem, height=2000, polygon=square),
                    lambda t, dem: t.volume(dem, plane=[(*p, 2000.0) for p in (*line, (-121.7, 46.8))],
                                            bbox=BOX)):
            served, local = ask(self.client, "rainier").report, ask(self.program, DEM).report
            for report in (served, local):
                report.pop("input", None), report.pop("seconds", None)
            self.assertEqual(served, local)

    def test_meshes_are_refined_and_measured_alike_served_and_made_here(self):
        ring = [(-121.77, 46.84), (-121.75, 46.84), (-121.75, 46.86), (-121.77, 46.84)]
        window = (-121.8, 46.82, -121.72, 46.89)
        for region in ({"bbox": (-121.77, 46.84, -121.75, 46.86)},
                       {"polygon": {"type": "Polygon", "coordinates": [ring]}},
                       {"route": ring[:3], "width": 300}):
            asked = {"inside": 2, "outside": 50, "window": window, "format": "obj", **region}
            served, local = self.client.refine("rainier", **asked), self.program.refine(DEM, **asked)
            self.assertEqual(served.bytes(), local.bytes())
            self.assertLessEqual(served.report["inside"]["max_error_m"], 2)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mesh.obj"
            served.save(path)
            for mesh in ({"mesh": path}, {"mesh": path.read_bytes(), "mesh_format": "obj"}):
                both = [self.client.measure("rainier", bbox=window, **mesh).report,
                        self.program.measure(DEM, bbox=window, **mesh).report]
                for report in both:
                    self.assertLessEqual(report["max_error_m"], 50)
                    report.pop("input", None), report.pop("dem"), report.pop("mesh")
                self.assertEqual(*both)
            coarse = self.client.simplify(None, mesh=path, ratio=0.2, method="qem").report
            self.assertLess(coarse["triangles"], 0.9 * coarse["input_triangles"])  # its border stays

    def test_methods_are_compared(self):
        for tind_, dem in ((self.client, "rainier"), (self.program, DEM)):
            result = tind_.compare(dem, methods=["bounded", "qem"], ratio=[0.1], bbox=BOX)
            self.assertEqual([row["method"] for row in result.report["table"]], ["bounded", "qem"])
            self.assertTrue(result.bytes().startswith(b"method,stop,triangles"))
            page = tind_.compare(dem, methods=["qem"], max_error=[20], bbox=BOX, format="html")
            self.assertIn(b"<h1>Simplifying rainier", page.bytes())

    def test_a_band_is_the_same_served_and_made_here(self):
        asked = {"interval": 200, "as_band": True, "max_error": 10, "bbox": BOX, "format": "geojson"}
        served = self.client.contours("rainier", **asked)
        self.assertEqual(served.bytes(), self.program.contours(DEM, **asked).bytes())
        self.assertGreater(len(json.loads(served.bytes())["features"]), 5)

    def test_what_is_wrong_names_its_parameter(self):
        with self.assertRaises(tind.TindError) as refused:
            self.client.simplify("rainier", max_error=-1)
        self.assertEqual(refused.exception.status, 400)
        self.assertEqual([e["parameter"] for e in refused.exception.errors], ["inputs.max_error"])
        with self.assertRaises(tind.TindError) as refused:
            self.program.simplify(DEM, max_error=-1)
        self.assertEqual(refused.exception.status, 2)
        with self.assertRaises(tind.TindError) as refused:
            self.client.dataset("there is none")
        self.assertEqual(refused.exception.status, 404)

    def test_what_takes_too_long_is_a_timeout(self):
        for tind_, dem in ((self.client, "rainier"), (self.program, DEM)):
            with self.assertRaises(TimeoutError):
                tind_.simplify(dem, max_error=1, timeout_s=0.001)

    def test_jobs_are_found_again_and_dismissed(self):
        job = self.client.submit("slope", "rainier")
        self.assertIn(job.id, [j["jobID"] for j in self.client.jobs()])
        self.assertEqual(self.client.job(job.id).wait().name, "raster")
        job.dismiss()
        with self.assertRaises(tind.TindError):
            job.wait()

    def test_many_at_once_come_with_their_numbers(self):
        orders = [("rainier", {"interval": i, "format": "geojson"}) for i in (0, 200, 500)]
        results = dict(self.client.run_all("contours", orders))
        self.assertIsInstance(results[0], tind.TindError)
        lines = [len(json.loads(results[i].bytes())["features"]) for i in (1, 2)]
        self.assertGreater(lines[0], lines[1])

    def test_a_tile_is_its_bytes(self):
        self.assertGreater(len(self.client.tile("rainier", 7, 41, 97)), 100)


class Interrupted(unittest.TestCase):
    """Against a server that has no room at first, and whose answers break off."""

    def test_who_has_no_room_is_asked_again_and_what_breaks_off_goes_on(self):
        whole = bytes(range(256)) * 400
        asked = []

        class Handler(BaseHTTPRequestHandler):
            def log_message(self, *_):
                pass

            def do_GET(self):
                asked.append(self.headers.get("Range"))
                if len(asked) == 1:
                    self.send_response(503)
                    self.send_header("Retry-After", "0")
                    self.end_headers()
                    return
                begin = int(asked[-1].split("=")[1][:-1]) if asked[-1] else 0
                self.send_response(206 if begin else 200)
                self.send_header("ETag", '"it"')
                self.send_header("Content-Length", str(len(whole) - begin))
                self.end_headers()
                self.wfile.write(whole[begin:begin + 60_000])

        server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        client = tind.Client(f"http://127.0.0.1:{server.server_port}")
        with tempfile.TemporaryDirectory() as folder:
            client._connection.download("/x", os.path.join(folder, "x"))
            self.assertEqual(pathlib.Path(folder, "x").read_bytes(), whole)
        self.assertEqual(asked, [None, None, "bytes=60000-"])
        server.shutdown()
        server.server_close()


class BehindAPath(unittest.TestCase):
    """Against a server that a proxy has put under a path, of which the server's links know nothing."""

    def test_results_are_fetched_where_the_job_is(self):
        answers = {
            "/maps/jobs/1": b'{"jobID": "1", "status": "successful"}',
            "/maps/jobs/1/results": b'{"mesh": {"href": "http://127.0.0.1:1/jobs/1/results/mesh"}}',
            "/maps/jobs/1/results/mesh": b"a mesh"}

        class Handler(BaseHTTPRequestHandler):
            def log_message(self, *_):
                pass

            def do_GET(self):
                body = answers.get(self.path)
                self.send_response(404 if body is None else 200)
                self.send_header("Content-Length", str(len(body or b"")))
                self.end_headers()
                self.wfile.write(body or b"")

        server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        client = tind.Client(f"http://127.0.0.1:{server.server_port}/maps")
        self.assertEqual(client.job("1").wait().bytes(), b"a mesh")
        server.shutdown()
        server.server_close()


if __name__ == "__main__":
    unittest.main()
