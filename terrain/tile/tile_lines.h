#pragma once
// The lines of a dataset (shape_lines.h) as one tile has them: on its integer grid, thinned as the
// level allows, their ends at vertices that the borders of both neighbours have.

#include <cmath>
#include <compare>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/shapes/area_set.h"
#include "terrain/shapes/shape_lines.h"
#include "terrain/tile/border.h"

namespace tind {

/// Where lines cross an edge, as vertices of its border: crossings that follow each other within
/// `gap` units at one height become one vertex, at the first of them; no vertex is on a corner.
/// REQUIRES: `crossings` by t. A function of these alone: so both tiles have the same.
class CrossingVertices {
 public:
  CrossingVertices() = default;
  CrossingVertices(std::span<const ShapeCrossing> crossings, int gap);

  struct Vertex {
    double first = 0;     // t of its first crossing
    double crossing = 0;  // t of the one that it stands for
    int t = 0;            // where it stands
    double height_m = 0;  // as ShapeCrossing
    bool shore = false;
  };
  const std::vector<Vertex>& all() const { return vertices_; }
  /// That of the crossing at t; null where there is none.
  const Vertex* of(double t) const;

 private:
  std::vector<Vertex> vertices_;
};

/// How far a line may be from where it is given, in units of the tile's grid, for an error in
/// metres: on the ground as far as in height. At most 1/256 of the side.
double line_tolerance(int level, double error_m);

struct TileLine {
  std::vector<Vec3> points;  // u, v: integers; z: metres, NaN: the surface's
  bool shore = false;
  bool water_left = false;                 // of a shore, seen along it
  bool closed = false;                     // first = last
  std::uint32_t between = AreaSet::kNone;  // of a shore: polygon of TileLines::between
};

struct TileLines {
  std::vector<TileLine> lines;
  /// What lies between shores as they are given and as they are here, in tile coordinates: a
  /// polygon for each level.
  AreaSet between;
  std::vector<double> level_between;  // of its polygons
  std::vector<AreaSet::Edge> edges_between;
};

/// `crossings`: of the tile's sides, by TileSide. `tolerance`: units of the grid; 0: every point
/// that the grid can hold. Only the inside depends on it, never where a line meets the border.
TileLines tile_lines(const ShapeLines&, TileId, const LineScale&,
                     std::span<const CrossingVertices> crossings, double tolerance);

/// Takes the ground around posts that are no part of the water, but too close to its shore for the
/// grid, out of the water: there the shore goes around them. The steeper it has to be up to a post,
/// the farther away the shore stays.
class ShoreBender {
 public:
  /// Posts may be `budget_m` from the mesh. `scale`: of all distances.
  ShoreBender(const TileLines&, double budget_m, double scale);
  void meet(const Vec3& post);
  /// The same lines as those given before. Those that end stay where they do.
  void bend(TileLines&) const;

 private:
  struct Segment {
    double level;
    Vec3 a, b;
  };
  struct Disc {
    double u = 0, v = 0, radius = 0, level = 0;
    friend auto operator<=>(const Disc&, const Disc&) = default;
  };
  double budget_m_, scale_;
  double low_ = HUGE_VAL, high_ = -HUGE_VAL;  // of the waters
  std::vector<Segment> segments_;
  std::vector<std::vector<std::uint32_t>> strips_;  // segments by v
  std::set<Disc> discs_;

  double clearance(double height_m) const;
};

}  // namespace tind
