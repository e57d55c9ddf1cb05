"""A tind server, asked from Python."""
from __future__ import annotations

import base64
import concurrent.futures
import os
from typing import Any, Callable, Iterable, Iterator

from tind.connection import Connection
from tind.errors import TindError
from tind.heights import Height, Heights, listed
from tind.jobs import Job, Result
from tind.processes import Processes

_MOST_PLACES = 100_000  # in one request


class Client(Processes):
    """url        of the server, with the path in front of its own where a proxy has put one
    key        where the server asks for one
    timeout_s  how long one answer may be silent
    retries    of requests that the server had no room for (503, 429), or whose answer broke off
    """

    def __init__(self, url: str = "http://127.0.0.1:8080", key: str | None = None,
                 timeout_s: float = 60, retries: int = 5):
        self._connection = Connection(url, key, timeout_s, retries)
        self._takes: dict[str, tuple[list[str], list[str]]] = {}  # inputs and outputs

    # --- what there is ----------------------------------------------------------------------------

    def datasets(self) -> list[dict[str, Any]]:
        """All of them, with bounds, levels, datum and where their resources are."""
        return self._connection.get("/datasets")["datasets"]

    def dataset(self, name: str) -> dict[str, Any]:
        for dataset in self.datasets():
            if dataset["name"] == name:
                return dataset
        raise TindError(f"there is no dataset {name!r}", 404)

    def methods(self) -> Any:
        """The methods of simplification, with their options."""
        return self._connection.get("/methods")

    def processes(self) -> list[dict[str, Any]]:
        return self._connection.get("/processes")["processes"]

    def describe(self, process: str) -> dict[str, Any]:
        """Its inputs with their JSON schemas, and its outputs."""
        return self._connection.get(f"/processes/{process}")

    # --- heights ----------------------------------------------------------------------------------

    def elevation(self, dataset: str, lon: float, lat: float, *, datum: str | None = None,
                  interpolation: str | None = None, level: int | None = None) -> Height:
        """The height at a place. `level`: as a client sees it that draws this level of tiles."""
        said = self._connection.get(f"/elevation/{dataset}",
                                    {"lon": lon, "lat": lat, **_heights(datum, interpolation, level)})
        return Height(said["height_m"], said["coverage"], said["datum"], said.get("max_error_m"),
                      said.get("low_m"), said.get("high_m"), said)

    def elevations(self, dataset: str, places: Any, *, crs: str | None = None,
                   datum: str | None = None, interpolation: str | None = None,
                   level: int | None = None) -> Heights:
        """The heights at many places, however many.

        places   pairs of longitude and latitude; an array of shape (n, 2); points of geopandas. With
                 `crs` ("EPSG:2056") pairs in the order of that system's axes
        """
        pairs, said = listed(places)
        query = {"crs": crs or said, **_heights(datum, interpolation, level)}
        parts = [self._of_pairs(dataset, pairs[i:i + _MOST_PLACES], query)
                 for i in range(0, max(1, len(pairs)), _MOST_PLACES)]
        if len(parts) == 1:
            return parts[0]

        def joined(lists: list[list[float | None] | None]) -> list[float | None] | None:
            return [value for one in lists for value in one or []] if level is not None else None

        return Heights([h for part in parts for h in part.height_m],
                       [c for part in parts for c in part.coverage], parts[0].datum,
                       joined([part.max_error_m for part in parts]),
                       joined([part.low_m for part in parts]), joined([part.high_m for part in parts]))

    def _of_pairs(self, dataset: str, pairs: Any, query: dict[str, Any]) -> Heights:
        said = self._connection.post(f"/elevation/{dataset}", {"locations": pairs}, query)
        return Heights(said["height_m"], said["coverage"], said["datum"], said.get("max_error_m"),
                       said.get("low_m"), said.get("high_m"))

    # --- tiles ------------------------------------------------------------------------------------

    def tile(self, dataset: str, z: int, x: int, y: int, format: str = "terrain") -> bytes:
        """One tile of EPSG:4326 with rows from the south: "terrain" (quantized-mesh) or "glb"."""
        return self._connection.get_bytes(f"/terrain/{dataset}/{z}/{x}/{y}.{format}")

    # --- work -------------------------------------------------------------------------------------

    def submit(self, process: str, dataset: str | None, **inputs: Any) -> Job:
        """Has it done as a job, and does not wait. `dataset`: None where a mesh is sent instead."""
        if process not in self._takes:
            described = self.describe(process)
            self._takes[process] = list(described["inputs"]), list(described["outputs"])
        names, outputs = self._takes[process]
        if "mesh" in inputs:
            inputs = _with_mesh(**inputs)

        def spelt(name: str) -> str:  # border_constraints: names of Python have no hyphens
            hyphens = name.replace("_", "-")
            return hyphens if name not in names and hyphens in names else name

        said = {spelt(name): _json_of(value) for name, value in {"dataset": dataset, **inputs}.items()
                if value is not None}
        job = self._connection.post(
            f"/processes/{process}/execution",
            {"inputs": said, "outputs": {name: {} for name in outputs}, "response": "document"},
            headers={"Prefer": "respond-async"})
        return Job(self._connection, job["jobID"])

    def run(self, process: str, dem: str | None, *, timeout_s: float | None = None,
            progress: Callable[[float, str], None] | None = None, **inputs: Any) -> Result:
        """Has it done, and waits. Who is interrupted has the job dismissed."""
        job = self.submit(process, dem, **inputs)
        try:
            return job.wait(timeout_s, progress)
        except (TimeoutError, KeyboardInterrupt):
            job.dismiss()
            raise

    def run_all(self, process: str, orders: Iterable[tuple[str, dict[str, Any]]],
                at_a_time: int = 4) -> Iterator[tuple[int, Result | TindError]]:
        """Many of one process: orders are (dataset, inputs). Each result, or why there is none, as
        it comes, with the number of its order."""
        pool = concurrent.futures.ThreadPoolExecutor(at_a_time)
        try:
            waiting = {pool.submit(self.run, process, dataset, **inputs): i
                       for i, (dataset, inputs) in enumerate(orders)}
            for done in concurrent.futures.as_completed(waiting):
                error = done.exception()
                if error is not None and not isinstance(error, TindError):
                    raise error
                yield waiting[done], error if error is not None else done.result()
        finally:  # who leaves early waits for what runs, not for what has not begun
            pool.shutdown(cancel_futures=True)

    def job(self, job_id: str) -> Job:
        """One that was submitted before."""
        return Job(self._connection, job_id)

    def jobs(self) -> list[dict[str, Any]]:
        """Those of this address."""
        return self._connection.get("/jobs")["jobs"]


def _heights(datum: str | None, interpolation: str | None, level: int | None) -> dict[str, Any]:
    return {"datum": datum, "interpolation": interpolation,
            "surface": None if level is None else f"level={level}"}


def _with_mesh(mesh: Any, mesh_format: str | None = None, **inputs: Any) -> dict[str, Any]:
    """A file's bytes, or bytes, as text; the format by the file's name."""
    if not isinstance(mesh, (bytes, bytearray)):
        name = os.fspath(mesh)
        ending = os.path.splitext(name)[1].lower().lstrip(".")
        mesh_format = mesh_format or {"xml": "landxml"}.get(ending, ending)
        with open(name, "rb") as file:
            mesh = file.read()
    return {"mesh": base64.b64encode(mesh).decode(), "mesh_format": mesh_format, **inputs}


def _json_of(value: Any) -> Any:
    """Tuples as lists, and what is a geometry (shapely, geopandas) as GeoJSON."""
    if hasattr(value, "__geo_interface__"):
        return value.__geo_interface__
    return list(value) if isinstance(value, tuple) else value
