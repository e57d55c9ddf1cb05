// Rings are clipped one side of the area after another [Sutherland, Hodgman: Reentrant Polygon
// Clipping, CACM 17(1), 1974]. What runs along the area's sides then closes a polygon and is no
// line that two polygons could share.

#include "terrain/shapes/shape_network.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace tind {

namespace {

using Index = std::uint32_t;

struct Side {
  bool of_x;
  double at, inward;  // +1: what is larger is inside
  double over(const Vec3& p) const { return ((of_x ? p.x : p.y) - at) * inward; }
  Vec3 cut(const Vec3& p, const Vec3& q) const {
    const double t = over(p) / (over(p) - over(q));
    Vec3 c = p + (q - p) * t;
    (of_x ? c.x : c.y) = at;
    return c;
  }
};

std::array<Side, 4> sides_of(const GeoRect& r) {
  return {{{true, r.west, 1}, {true, r.east, -1}, {false, r.south, 1}, {false, r.north, -1}}};
}

GlobeLine clip_ring(GlobeLine ring, const GeoRect& area) {
  for (const Side& side : sides_of(area)) {
    GlobeLine kept;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec3 &p = ring[i], &q = ring[(i + 1) % ring.size()];
      const bool from = side.over(p) >= 0, to = side.over(q) >= 0;
      if (from) kept.push_back(p);
      if (from != to) kept.push_back(side.cut(p, q));
    }
    ring = std::move(kept);
  }
  return ring;
}

/// Nothing, or what of the segment lies in the area.
bool clip_segment(Vec3& p, Vec3& q, const GeoRect& area) {
  for (const Side& side : sides_of(area)) {
    const bool from = side.over(p) >= 0, to = side.over(q) >= 0;
    if (!from && !to) return false;
    if (from != to) (from ? q : p) = side.cut(p, q);
  }
  return true;
}

class Builder {
 public:
  Builder(const GlobeLattice& lattice, std::size_t polygons) : lattice_(lattice) {
    out_.touching.resize(polygons);
    std::iota(out_.touching.begin(), out_.touching.end(), 0);
    const GeoRect& a = lattice_.area;
    const Vec3 low = on_lattice({a.west, a.south, 0}), high = on_lattice({a.east, a.north, 0});
    area_ = {low.x, low.y, high.x, high.y};
  }

  void add(const GlobePolygon& polygon, Index number) {
    for (const GlobeLine& given : polygon.rings) {
      GlobeLine ring;
      for (const Vec3& p : given) {
        if (usable(p)) ring.push_back(on_lattice(p));
        out_.not_finite += !usable(p);
      }
      for (const double turn : {0.0, 360.0, -360.0})
        if (meets(ring, turn)) add_chain(clip_ring(turned(ring, turn), area_), number, true);
    }
  }
  /// A line is broken where a point is missing.
  void add(const GlobeLine& given, Index source) {
    GlobeLine line;
    for (const Vec3& p : given) {
      line.push_back(on_lattice(p));
      out_.not_finite += !usable(p);
    }
    for (const double turn : {0.0, 360.0, -360.0}) {
      if (!meets(line, turn)) continue;
      const GlobeLine there = turned(line, turn);
      for (std::size_t i = 1; i < there.size(); ++i) {
        Vec3 p = there[i - 1], q = there[i];
        if (usable(given[i - 1]) && usable(given[i]) && clip_segment(p, q, area_))
          add_chain({p, q}, source, false);
      }
    }
  }

  Result<ShapeNetwork> build() {
    const auto repairs = repair_lines(network_);
    if (!repairs) return std::unexpected(repairs.error());
    out_.repairs = *repairs;
    find_edges();
    for (Index p = 0; p < out_.touching.size(); ++p) out_.touching[p] = root(p);
    const double half = lattice_.unit / kLineLattice / 2;
    const auto degrees = [&](double v, double from) { return from + v * lattice_.unit + half; };
    for (const Vec3& p : network_.points)
      out_.points.push_back({degrees(p.x, origin().x), degrees(p.y, origin().y), p.z});
    return std::move(out_);
  }

 private:
  const GlobeLattice& lattice_;
  ShapeNetwork out_;
  LineNetwork network_;
  GeoRect area_;  // on the lattice

  /// A multiple of the unit, so that nothing is lost when it is taken away.
  Vec2 origin() const {
    const double u = lattice_.unit;
    return {std::floor(lattice_.area.west / u) * u, std::floor(lattice_.area.south / u) * u};
  }
  Vec3 on_lattice(const Vec3& p) const {
    return {snap_to_line_lattice((p.x - origin().x) / lattice_.unit),
            snap_to_line_lattice((p.y - origin().y) / lattice_.unit), p.z};
  }
  static bool usable(const Vec3& p) { return std::abs(p.x) < 1e4 && std::abs(p.y) < 1e4; }
  /// Whole steps of the lattice: nothing is rounded.
  GlobeLine turned(GlobeLine line, double degrees) const {
    for (Vec3& p : line) p.x += degrees / lattice_.unit;
    return line;
  }
  bool meets(const GlobeLine& line, double degrees) const {
    double west = HUGE_VAL, east = -HUGE_VAL;
    for (const Vec3& p : line) west = std::min(west, p.x), east = std::max(east, p.x);
    const double turn = degrees / lattice_.unit;
    return west + turn <= area_.east && east + turn >= area_.west;
  }

  void add_chain(const GlobeLine& line, Index source, bool ring) {
    if (line.size() < 2) return;
    const Index first = Index(network_.points.size());
    Index count = 0;
    for (const Vec3& p : line) {
      const Vec3 at{snap_to_line_lattice(p.x), snap_to_line_lattice(p.y), p.z};
      if (count > 0 && at.x == network_.points.back().x && at.y == network_.points.back().y)
        continue;
      network_.points.push_back(at);
      ++count;
    }
    for (Index k = 1; k < count; ++k)
      network_.segments.push_back({first + k - 1, first + k, source});
    const auto same = [&](const Vec3& p, const Vec3& q) { return p.x == q.x && p.y == q.y; };
    if (ring && count > 2 && !same(network_.points[first], network_.points.back()))
      network_.segments.push_back({first + count - 1, first, source});
  }

  Index root(Index p) {
    while (out_.touching[p] != p) p = out_.touching[p] = out_.touching[out_.touching[p]];
    return p;
  }
  /// The lower number stands for both.
  void join(Index p, Index q) {
    p = root(p), q = root(q);
    out_.touching[std::max(p, q)] = std::min(p, q);
  }
  bool on_rim(const Vec3& p) const {
    return p.x == area_.west || p.x == area_.east || p.y == area_.south || p.y == area_.north;
  }

  void find_edges() {
    auto& all = network_.segments;
    for (LineSegment& s : all)
      if (s.a > s.b) std::swap(s.a, s.b);
    std::sort(all.begin(), all.end());
    const Index polygons = Index(out_.touching.size());
    std::vector<Index> first(network_.points.size(), AreaSet::kNone);  // polygon at each point
    for (std::size_t i = 0; i < all.size();) {
      ShapeEdge edge{all[i].a, all[i].b, {}, AreaSet::kNone};
      while (i < all.size() && all[i].a == edge.a && all[i].b == edge.b) {
        const Index source = all[i].source;
        std::size_t times = 0;
        for (;
             i < all.size() && all[i].a == edge.a && all[i].b == edge.b && all[i].source == source;
             ++i)
          ++times;
        if (source >= polygons) {
          if (edge.line == AreaSet::kNone) edge.line = source - polygons;
          continue;
        }
        if (times % 2) edge.polygons.push_back(source);
        for (const Index v : {edge.a, edge.b}) {
          if (on_rim(network_.points[v])) continue;
          if (first[v] == AreaSet::kNone) first[v] = source;
          join(first[v], source);
        }
      }
      if (!edge.polygons.empty() || edge.line != AreaSet::kNone)
        out_.edges.push_back(std::move(edge));
    }
  }
};

}  // namespace

GlobeLattice GlobeLattice::make(const GeoRect& area, double spacing_deg) {
  constexpr double kMostUnits = 30000;  // constrained_delaunay.h wants less than 2^15
  const double extent = std::max(area.width(), area.height());
  double unit = 180;
  while (unit > spacing_deg && unit / 2 >= extent / kMostUnits) unit /= 2;
  return {area, unit};
}

Result<ShapeNetwork> shape_network(const GlobeLattice& lattice,
                                   const std::vector<GlobePolygon>& polygons,
                                   const std::vector<GlobeLine>& lines) {
  Builder builder(lattice, polygons.size());
  for (Index k = 0; k < polygons.size(); ++k) builder.add(polygons[k], k);
  for (Index k = 0; k < lines.size(); ++k) builder.add(lines[k], Index(polygons.size()) + k);
  return builder.build();
}

}  // namespace tind
