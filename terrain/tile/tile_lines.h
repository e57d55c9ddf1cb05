#pragma once
// The lines of a dataset (shape_lines.h) as one tile has them: on its integer grid, thinned as the
// level allows, their ends at vertices that the borders of both neighbours have.

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
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
  bool closed = false;                     // first = last
  std::uint32_t between = AreaSet::kNone;  // polygon of TileLines::between
};

struct TileLines {
  std::vector<TileLine> lines;
  /// What lies between shores as they are given and as they are here, in tile coordinates, and the
  /// level there.
  AreaSet between;
  std::vector<double> level_between;  // of its polygons
  std::vector<AreaSet::Edge> edges_between;
};

/// `crossings`: of the tile's sides, by TileSide. `tolerance`: units of the grid; 0: every point
/// that the grid can hold. Only the inside depends on it, never where a line meets the border.
TileLines tile_lines(const ShapeLines&, TileId, const LineScale&,
                     std::span<const CrossingVertices> crossings, double tolerance);

/// Finds posts that are as good as on a shore without being at its level, and leads the shore past
/// them on the side of the water.
class ShoreBender {
 public:
  explicit ShoreBender(const TileLines&);
  /// A post that may be `most` from the level.
  void meet(const Vec3& post, double most);
  /// The same lines as those given before. `wet`: is a place water, as the shapes are given?
  void bend(TileLines&, const std::function<bool(double u, double v)>& wet) const;

 private:
  struct Segment {
    std::uint32_t line, at;  // from point `at` to the next
    Vec3 a, b;
  };
  std::vector<Segment> segments_;
  std::vector<std::vector<std::uint32_t>> strips_;  // segments by v
  /// By line and number of the point before, and by line and number of the point itself.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Vec3>> beside_segment_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> beside_point_;
};

}  // namespace tind
