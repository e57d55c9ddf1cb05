"""The program on this machine, asked as a server is."""
from __future__ import annotations

import csv
import io
import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from typing import Any

from tind.errors import TindError
from tind.heights import Heights, listed
from tind.jobs import LocalResult, Result
from tind.processes import Processes


@dataclass(frozen=True)
class _Command:
    """What a subcommand makes, and which of its options have other names than the inputs."""

    output: str | None = "raster"  # None: a report alone
    format: str = "tif"
    report: bool = True
    crs: str = "bounds-crs"
    polygon: str = "boundary"
    bbox: str = "bounds"


_COMMANDS = {
    "simplify": _Command("mesh", "ply"),
    "contours": _Command("contours", "gpkg"),
    "profile": _Command("profile", "csv", report=False, crs="places-crs"),
    "line-of-sight": _Command(None, crs="places-crs"),
    "viewshed": _Command("viewshed", crs="places-crs"),
    "volume": _Command(None, polygon="area"),
    "statistics": _Command("statistics", "csv", report=False),
    "difference": _Command("difference"),
    "refine": _Command("mesh", "ply", polygon="polygon", bbox="bbox"),
    "compare": _Command("table", "csv"),
    "measure": _Command(None),
}
_SHAPES = ("polygon", "breaklines", "flatten", "polygons")  # GeoJSON, which goes there as a file
_PLACES = ("from", "to", "line", "plane")


class Program(Processes):
    """path: of the program, or its name where PATH leads to it. What takes longer than a
    `timeout_s` is stopped: TimeoutError."""

    def __init__(self, path: str | os.PathLike[str] = "tind"):
        self._path = os.fspath(path)

    def run(self, process: str, dem: str | os.PathLike[str], *, timeout_s: float | None = None,
            **inputs: Any) -> Result:
        command = _COMMANDS.get(process, _Command())
        folder = tempfile.mkdtemp(prefix="tind-")
        kind = inputs.pop("format", None) or command.format
        file = f"{command.output or 'report'}.{kind}"
        result = LocalResult(command.output or "report", folder, file)  # the folder goes with it
        words = [self._path, process]
        if process == "measure":
            words.append(_mesh_file(inputs, folder))
        words.append(os.fspath(dem))
        flag = kind if process == "compare" else "output"
        words += [f"--{flag}={os.path.join(folder, file)}"] if command.output else []
        report = os.path.join(folder, "figures.json")
        words += [f"--report={report}"] if process == "compare" else ["--json"] if command.report else []
        unit = inputs.pop("unit", None)
        if unit not in (None, "degree", "percent"):
            raise TindError(f"unit must be one of degree, percent, not {unit}")
        if unit == "percent":
            words.append("--percent")
        crs = inputs.get("crs")
        if command.crs == "bounds-crs" and inputs.get("bbox") is None:
            inputs.pop("crs", None)  # of shapes alone, which say it themselves
        for key, value in inputs.items():
            if value is not None:
                words += _option(command, key, value, folder, crs)
        said = _run(words, timeout_s)
        if process == "compare":
            with open(report, encoding="utf-8") as figures:
                said = figures.read()
        if command.output is None:
            return Result("report", _report_of(said))
        result.report = _report_of(said)
        return result

    def elevations(self, dem: str | os.PathLike[str], places: Any, *, crs: str | None = None,
                   interpolation: str | None = None, datum: str | None = None) -> Heights:
        """The heights of a DEM at many places, as Client.elevations() has them; but of pairs in a
        `crs` x (east) comes before y, as in tables."""
        pairs, said = listed(places, east_first=True)
        table = "x,y\n" + "".join(f"{x!r},{y!r}\n" for x, y in pairs)
        words = [self._path, "elevation", os.fspath(dem), "--places=-"]
        for flag, value in (("places-crs", crs or said), ("interpolation", interpolation),
                            ("to-datum", datum)):
            words += [f"--{flag}={value}"] if value else []
        rows = list(csv.DictReader(io.StringIO(_run(words, None, table))))
        return Heights([float(row["height_m"]) if row["height_m"] else None for row in rows],
                       [row["coverage"] for row in rows], datum or self._datum(dem))

    def _datum(self, dem: str | os.PathLike[str]) -> str:
        return json.loads(_run([self._path, "info", os.fspath(dem), "--json"], None))["datum"]


def _mesh_file(inputs: dict[str, Any], folder: str) -> str:
    """Bytes are a file first."""
    mesh, kind = inputs.pop("mesh"), inputs.pop("mesh_format", None)
    if not isinstance(mesh, (bytes, bytearray)) and kind is None:
        return os.fspath(mesh)
    path = os.path.join(folder, "mesh." + {"landxml": "xml"}.get(kind or "", kind or ""))
    if isinstance(mesh, (bytes, bytearray)):
        with open(path, "wb") as file:
            file.write(mesh)
    else:
        shutil.copyfile(mesh, path)
    return path


def _numbers(value: Any) -> str:
    return " ".join(",".join(map(repr, map(float, point))) for point in value)


def _geojson(shape: Any, crs: str | None) -> dict[str, Any]:
    """As the server is asked: of bare GeoJSON `crs` says what its numbers are."""
    shape = getattr(shape, "__geo_interface__", shape)
    if crs is None or "crs" in shape:
        return shape
    authority, _, code = crs.partition(":")
    name = f"urn:ogc:def:crs:{authority}::{code}" if code else "urn:ogc:def:crs:OGC:1.3:CRS84"
    return {**shape, "crs": {"type": "name", "properties": {"name": name}}}


def _option(command: _Command, name: str, value: Any, folder: str, crs: str | None) -> list[str]:
    if command.bbox == "bbox":  # refine, which takes its region as text
        if name == "window":
            name, value = "bounds", ",".join(map(str, value))
        elif name == "polygon":
            shape = getattr(value, "__geo_interface__", value)
            if not isinstance(shape, dict) or shape.get("type") != "Polygon" or len(shape["coordinates"]) != 1:
                raise TindError("polygon must be a Polygon of GeoJSON of one ring")
            return [f"--polygon={_numbers(shape['coordinates'][0])}"]
        elif name == "route":
            value = _numbers(value)
    if command.output == "table" and name in ("triangles", "ratio"):
        each = [value] if isinstance(value, (int, float)) else value
        value = [f"{100 * one:.12g}%" for one in each] if name == "ratio" else each
        name = "at"
    flag = {"bbox": command.bbox, "crs": command.crs, "datum": "to-datum",
            "polygon": command.polygon}.get(name, name.replace("_", "-"))
    if name in _SHAPES:
        path = os.path.join(folder, f"{name}.geojson")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(_geojson(value, crs), file)
        return [f"--{flag}={path}"]
    if isinstance(value, bool):
        return [f"--{flag}"] if value else []
    if name in _PLACES:
        points = [value] if name in ("from", "to") else value
        value = _numbers(points)
    elif isinstance(value, (list, tuple)):
        value = ",".join(map(str, value))
    return [f"--{flag}={value}"]


def _run(words: list[str], timeout_s: float | None, given: str | None = None) -> str:
    try:
        done = subprocess.run(words, input=given, capture_output=True, text=True, timeout=timeout_s)
    except FileNotFoundError as error:
        raise TindError(f"there is no program {words[0]}: Program('/path/of/tind')") from error
    except subprocess.TimeoutExpired as error:  # as of a job that takes longer
        raise TimeoutError(f"{words[1]} was stopped after {timeout_s} s") from error
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines()
                 if line.strip() and not line.startswith("Run with --help")]
        raise TindError(lines[-1] if lines else f"{words[0]} ended with {done.returncode}",
                        done.returncode)
    return done.stdout


def _report_of(text: str) -> dict[str, Any] | None:
    return json.loads(text) if text.strip().startswith("{") else None
