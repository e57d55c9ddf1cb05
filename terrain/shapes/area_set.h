#pragma once
// Polygons on the globe: which of them hold a place, and which stretches of a parallel lie in them.

#include <cstdint>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

/// A polygon is any set of edges that closes, in degrees (x = lon, y = lat); a place is inside
/// where an odd number of its edges crosses the parallel to the east of it. Edges hold their
/// southern end and not the northern one, so that every place is inside or outside, also one on an
/// outline. Longitudes may go beyond +-180: ask for those.
class AreaSet {
 public:
  struct Edge {
    Vec2 a, b;
    std::uint32_t polygon = 0;
  };
  /// Of a parallel.
  struct Span {
    double west = 0, east = 0;
    std::uint32_t polygon = 0;
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  AreaSet() = default;
  explicit AreaSet(std::vector<Edge> edges);

  bool empty() const { return edges_.empty(); }
  std::size_t polygons() const { return bounds_.size(); }
  /// Of a polygon with no edge: west > east.
  const GeoRect& bounds(std::uint32_t polygon) const { return bounds_[polygon]; }

  /// The polygon of the lowest number that holds the place; kNone where none does. O(edges that
  /// cross the parallel).
  std::uint32_t holding(double lon, double lat) const;
  /// All that hold it, in order.
  void all_holding(double lon, double lat, std::vector<std::uint32_t>& polygons) const;
  /// What of a parallel lies in polygons, polygon by polygon, each from west to east. A place is in
  /// a span when west <= lon < east.
  void spans(double lat, std::vector<Span>&) const;
  /// Does any edge touch the rectangle? Where none does, it is wholly inside or outside each
  /// polygon.
  bool crosses(const GeoRect&) const;

 private:
  std::vector<Edge> edges_;  // by polygon; a is the southern end
  std::vector<GeoRect> bounds_;
  double south_ = 0, per_strip_ = 1;
  /// Edges by strips of latitude, in order of their polygons.
  std::vector<std::uint32_t> strip_start_, in_strip_;

  std::size_t strips() const { return strip_start_.empty() ? 0 : strip_start_.size() - 1; }
  std::size_t strip_of(double lat) const;
  template <class F>
  void each_crossing(double lat, F&& f) const;
};

}  // namespace tind
