#pragma once
// The user's lines and polygons on the globe, repaired: clipped to where the DEM is, crossings made
// vertices, what nearly touches joined (constrained_delaunay.h).

#include <cstdint>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/raster/gdal/vectors/vector_source.h"
#include "terrain/shapes/area_set.h"

namespace tind {

/// As read_vectors_on_globe() gives them: x = lon, y = lat, z = metres or NaN.
using GlobeLine = VectorLine;
using GlobePolygon = VectorPolygon;

/// The lattice on which the repair works, in degrees. Its unit is 180 / 2^k, so that lines that lie
/// 360 degrees apart stay so to the last bit.
struct GlobeLattice {
  GeoRect area;     // what counts
  double unit = 1;  // degrees: what a post is to constrained_delaunay.h

  /// REQUIRES: spacing_deg > 0.
  static GlobeLattice make(const GeoRect& area, double spacing_deg);
};

struct ShapeEdge {
  std::uint32_t a, b;                   // points, a < b
  std::vector<std::uint32_t> polygons;  // whose outlines it is an odd number of times
  std::uint32_t line = AreaSet::kNone;  // the first breakline that it is part of
};

struct ShapeNetwork {
  /// No coordinate is that of a tile's edge: all are half a step of the lattice beside it.
  std::vector<Vec3> points;
  std::vector<ShapeEdge> edges;
  /// Sets of polygons that touch, cross or overlap: the lowest number of each one's set. (Of those
  /// that lie in one another without touching, the caller knows.)
  std::vector<std::uint32_t> touching;
  LineRepairs repairs;
  std::size_t not_finite = 0;  // points left out
};

/// Polygons are numbered as given, and so are lines. One that also lies elsewhere by 360 degrees
/// counts there, too. O(n log n). Fails (unsupported) without CGAL.
Result<ShapeNetwork> shape_network(const GlobeLattice&, const std::vector<GlobePolygon>&,
                                   const std::vector<GlobeLine>& lines);

}  // namespace tind
