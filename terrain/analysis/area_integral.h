#pragma once
// Volumes between a surface and zero over an area, exactly: the integral of the bilinear surface
// itself over each cell's part of the polygons, not a sum over posts.
//
// Over a cell D is a + b x + c y + d x y. An area's part of it is cut into slabs between the places
// in y where something turns: a vertex, where an edge crosses a side of the cell, where D is zero
// on an edge. In a slab the part between two edges is a trapezoid; along x D is a line, whose
// positive part has an integral in closed form; along y that integral is smooth (a polynomial, or a
// ratio of such), and Gauss's rule has it to rounding.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// Polygons in post coordinates, x = column, y = row; closed or not. A place is inside when it is
/// in an odd number of rings. Edges are straight among the posts.
using PostRings = std::vector<std::vector<Vec2>>;

/// All of a DEM: from its first post to its last.
PostRings whole_area(const DemInfo&);

/// The ground that a column times a row is, m^2, at a place among the posts: on the ellipsoid for
/// degrees, in the plane of the projection else.
class GroundArea {
 public:
  explicit GroundArea(const DemInfo&);
  double at(double col, double row) const;

 private:
  Affine map_;
  double degrees_ = 0, unit_m_ = 1;  // degrees_: 0 where not geographic
};

/// D at the posts of a row, NaN where there is none.
using PostRow = std::function<Result<void>(std::int64_t row, std::span<double> out)>;

struct AreaIntegral {
  double area_m2 = 0;       // where D is
  double void_area_m2 = 0;  // inside, where it is not: a void, by the rule of raster/interpolate.h
  double above_m3 = 0, below_m3 = 0;  // of D above zero, and below; both not negative
  /// The least and the most that they are when D is off by up to the uncertainty at each post.
  double above_low_m3 = 0, above_high_m3 = 0, below_low_m3 = 0, below_high_m3 = 0;
};

/// What of the area lies beyond the outermost posts is not counted. Each row is read once, from the
/// north. O(cells inside + edges per row * cells at the rim). Fails with what `rows` fails with,
/// and (cancelled).
Result<AreaIntegral> integrate(const DemInfo&, const PostRings& area, const PostRow& rows,
                               double uncertainty_m = 0, const Progress& = {});

/// Does some of the area lie beyond the outermost posts?
bool reaches_beyond(const DemInfo&, const PostRings& area);

}  // namespace tind
