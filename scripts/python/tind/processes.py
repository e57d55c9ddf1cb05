"""The processes by their names, for the server and for the local program alike.

What they take beside what is named here is what `/processes/{id}` lists: `bbox`, `crs`, `datum`,
`format`, `layer` and the options of each.
"""
from __future__ import annotations

from typing import Any

from tind.jobs import Result


class Processes:
    """One method a process. `dem`: a dataset of the server, or a file of the local program."""

    def run(self, process: str, dem: str | None, **inputs: Any) -> Result:
        raise NotImplementedError

    def simplify(self, dem: str | None, **inputs: Any) -> Result:
        """An area as one mesh: max_error=, triangles= or ratio=; method=, bbox= or polygon=,
        breaklines=, flatten=, format=, frame=. Of a server, None with mesh= is a TIN of one's own:
        a file, or bytes with mesh_format=."""
        return self.run("simplify", dem, **inputs)

    def slope(self, dem: str, **inputs: Any) -> Result:
        """unit="degree" or "percent"."""
        return self.run("slope", dem, **inputs)

    def aspect(self, dem: str, **inputs: Any) -> Result:
        return self.run("aspect", dem, **inputs)

    def hillshade(self, dem: str, **inputs: Any) -> Result:
        """azimuth=, altitude=, z_factor=."""
        return self.run("hillshade", dem, **inputs)

    def roughness(self, dem: str, **inputs: Any) -> Result:
        return self.run("roughness", dem, **inputs)

    def tri(self, dem: str, **inputs: Any) -> Result:
        return self.run("tri", dem, **inputs)

    def tpi(self, dem: str, **inputs: Any) -> Result:
        return self.run("tpi", dem, **inputs)

    def contours(self, dem: str, **inputs: Any) -> Result:
        """interval= and base=, or levels=; format="gpkg", "fgb" or "geojson". as_band=True with
        max_error= or level=: areas in which the heights certainly are, when a mesh is all that is known."""
        return self.run("contours", dem, **inputs)

    def relief(self, dem: str, **inputs: Any) -> Result:
        """Heights as colours, in the light of a hillshade."""
        return self.run("relief", dem, **inputs)

    def profile(self, dem: str, line: Any, **inputs: Any) -> Result:
        """line: places along it. Wherever the surface turns, or samples= or step=; format="csv",
        "geojson", "json" or "covjson"; level= of a server's tiles in place of the DEM."""
        return self.run("profile", dem, line=line, **inputs)

    def line_of_sight(self, dem: str, observer: Any, target: Any, **inputs: Any) -> Result:
        """from_height=, to_height=, refraction=, uncertainty=, level=. The report says "visible",
        "hidden", or, within the uncertainty, "depends"."""
        return self.run("line-of-sight", dem, **{"from": observer, "to": target}, **inputs)

    def viewshed(self, dem: str, observer: Any, **inputs: Any) -> Result:
        """radius=, from_height=, to_height=, refraction=, uncertainty=, level=."""
        return self.run("viewshed", dem, **{"from": observer}, **inputs)

    def volume(self, dem: str, **inputs: Any) -> Result:
        """height=, plane= (three points) or against= (another dataset, or file); bbox= or polygon=,
        uncertainty=, level=."""
        return self.run("volume", dem, **inputs)

    def statistics(self, dem: str, polygons: Any, **inputs: Any) -> Result:
        """A row for each of the polygons of GeoJSON."""
        return self.run("statistics", dem, polygons=polygons, **inputs)

    def difference(self, dem: str, less: str, **inputs: Any) -> Result:
        """dem less another dataset, or file, as a raster."""
        return self.run("difference", dem, less=less, **inputs)

    def refine(self, dem: str, **inputs: Any) -> Result:
        """One mesh, fine in a region: bbox=, polygon=, or route= with width=; inside=, outside=,
        window=, format=, frame=."""
        return self.run("refine", dem, **inputs)

    def compare(self, dem: str, **inputs: Any) -> Result:
        """Several methods=, each until each of max_error=, triangles= or ratio= (lists). The report
        has the table; format="csv" or "html", a page with curves and pictures."""
        return self.run("compare", dem, **inputs)

    def measure(self, dem: str, mesh: Any, **inputs: Any) -> Result:
        """mesh: a file (.ply, .obj, .stl, .2dm, .xml), or its bytes with mesh_format=. frame=,
        units=, bbox=."""
        return self.run("measure", dem, mesh=mesh, **inputs)
