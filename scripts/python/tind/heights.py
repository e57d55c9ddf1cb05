"""Places in whatever form Python programs have them, and the heights there."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Height:
    """Of one place. height_m is None unless coverage is "value" (else "void" or "outside")."""

    height_m: float | None
    coverage: str
    datum: str
    max_error_m: float | None = None  # of tiles: no post of the tile is farther from its mesh
    low_m: float | None = None  # of tiles: the DEM's height here, also between posts, is not below,
    high_m: float | None = None  # nor above
    said: dict[str, Any] = field(default_factory=dict, repr=False)  # all of the answer


@dataclass(frozen=True)
class Heights:
    """Of many places, in their order."""

    height_m: list[float | None]
    coverage: list[str]
    datum: str
    max_error_m: list[float | None] | None = None
    low_m: list[float | None] | None = None
    high_m: list[float | None] | None = None

    def __len__(self) -> int:
        return len(self.height_m)

    def __iter__(self):
        return iter(self.height_m)

    def __getitem__(self, index: int) -> float | None:
        return self.height_m[index]

    def array(self) -> Any:
        """As a numpy array, NaN where there is no height."""
        import numpy

        return numpy.array([float("nan") if h is None else h for h in self.height_m])


def listed(places: Any, east_first: bool = False) -> tuple[list[list[float]], str | None]:
    """Pairs of numbers, and the CRS where the places say one. Points of geopandas have x before y;
    their pairs are in the order of the axes of their CRS, as whoever asks by its code expects,
    unless he has said `east_first`."""
    points = getattr(places, "geometry", places)
    if hasattr(points, "x") and hasattr(points, "y") and hasattr(points, "crs"):
        pairs = [[float(x), float(y)] for x, y in zip(points.x, points.y)]
        code = points.crs.to_epsg() if points.crs is not None else 4326
        if code is None:
            raise ValueError("the places are in a CRS without a code of EPSG: use to_crs() first")
        if code == 4326:
            return pairs, None
        if not east_first and points.crs.axis_info[0].direction in ("north", "south"):
            pairs = [[y, x] for x, y in pairs]
        return pairs, f"EPSG:{code}"
    if hasattr(points, "tolist"):  # an array
        points = points.tolist()
    return [[float(x), float(y)] for x, y, *_ in points], None
