// Polygons are clipped like lines. What of them lies outside the DEM's rectangle is no line of the
// mesh, but still tells inside from outside.

#include "terrain/simplify/constraints/constraint_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "terrain/mesh/exact_line.h"
#include "terrain/simplify/constraints/cell_cover.h"

namespace tind {

namespace {

using Index = std::uint32_t;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kHalvings = 12;
constexpr double kPiece = 1.42;  // posts: the longest piece of a part

enum class Role { breakline, flatten, boundary, rim };
struct Source {
  Role role;
  Index shape;  // of its kind
  Vec3 a, b;    // as given, clipped, on the lattice
};

class NetworkBuilder {
 public:
  NetworkBuilder(const HeightGrid& grid, const ConstraintShapes& shapes, ConstraintReport& report)
      : shapes_(shapes), report_(report), cols_(grid.cols()), rows_(grid.rows()), cells_(grid) {
    out_.flat = out_.boundary = PolygonSet(rows_);
    for (const float z : grid.values()) has_voids_ |= std::isnan(z);
  }

  Result<ConstraintNetwork> build() {
    gather();
    if (has_voids_) add_rims();
    const auto repairs = repair_lines(network_);
    if (!repairs) return std::unexpected(repairs.error());
    report_.repairs = *repairs;
    measure_moves();
    find_parts();
    out_.points = std::move(network_.points);
    return std::move(out_);
  }

 private:
  const ConstraintShapes& shapes_;
  ConstraintReport& report_;
  const int cols_, rows_;
  bool has_voids_ = false;
  CellCover cells_;
  ConstraintNetwork out_;
  LineNetwork network_;
  std::vector<Source> sources_;
  /// Edges of each polygon outside the rectangle: they only tell inside from outside.
  std::vector<std::vector<PolygonSet::Edge>> beyond_flat_, beyond_boundary_;

  // --- what was given --------------------------------------------------------------------------

  void gather() {
    ConstraintReport& r = report_;
    r.breaklines = shapes_.breaklines.size();
    r.flattened = shapes_.flatten.size();
    r.boundaries = shapes_.boundary.size();
    for (Index i = 0; i < shapes_.breaklines.size(); ++i)
      add_chain(shapes_.breaklines[i], Role::breakline, i, false, nullptr);
    beyond_flat_.resize(shapes_.flatten.size());
    for (Index i = 0; i < shapes_.flatten.size(); ++i)
      for (const VectorLine& ring : shapes_.flatten[i].rings)
        add_chain(ring, Role::flatten, i, true, &beyond_flat_[i]);
    beyond_boundary_.resize(shapes_.boundary.size());
    for (Index i = 0; i < shapes_.boundary.size(); ++i)
      for (const VectorLine& ring : shapes_.boundary[i].rings)
        add_chain(ring, Role::boundary, i, true, &beyond_boundary_[i]);
  }

  void add_chain(const VectorLine& given, Role role, Index shape, bool ring,
                 std::vector<PolygonSet::Edge>* beyond) {
    std::vector<Vec3> points;
    for (const Vec3& p : given) {
      const bool usable = std::abs(p.x) < 1e7 && std::abs(p.y) < 1e7;  // not NaN, not beyond reason
      if (usable) points.push_back({snap_to_line_lattice(p.x), snap_to_line_lattice(p.y), p.z});
      report_.not_finite += !usable;
      // A line is broken where a point is missing; a ring closes over it.
      if (!usable && !ring) add_points(points, role, shape, beyond), points.clear();
    }
    if (ring && points.size() > 1) points.push_back(points.front());
    add_points(points, role, shape, beyond);
  }

  void add_points(const std::vector<Vec3>& points, Role role, Index shape,
                  std::vector<PolygonSet::Edge>* beyond) {
    for (std::size_t i = 1; i < points.size(); ++i) {
      const bool closing = i + 1 == points.size();
      if (points[i - 1].x == points[i].x && points[i - 1].y == points[i].y)
        report_.without_length += !(beyond && closing);
      else
        add_segment(points[i - 1], points[i], role, shape, beyond);
    }
  }

  void add_segment(const Vec3& a, const Vec3& b, Role role, Index shape,
                   std::vector<PolygonSet::Edge>* beyond) {
    double t0 = 0, t1 = 1;
    const auto cut = [&](double from, double step, double low, double high) {
      if (step == 0) return from >= low && from <= high;
      const double s = (low - from) / step, t = (high - from) / step;
      t0 = std::max(t0, std::min(s, t));
      t1 = std::min(t1, std::max(s, t));
      return true;
    };
    const bool meets =
        cut(a.x, b.x - a.x, 0, cols_ - 1) && cut(a.y, b.y - a.y, 1 - rows_, 0) && t0 < t1;
    if (!meets) {
      report_.outside += role != Role::rim;
      if (beyond) beyond->push_back({{a.x, a.y}, {b.x, b.y}});
      return;
    }
    const Vec3 p = t0 > 0 ? inside_at(a, b, t0) : a, q = t1 < 1 ? inside_at(a, b, t1) : b;
    if (beyond && t0 > 0) beyond->push_back({{a.x, a.y}, {p.x, p.y}});
    if (beyond && t1 < 1) beyond->push_back({{q.x, q.y}, {b.x, b.y}});
    if (p.x == q.x && p.y == q.y) return;
    const Index at = Index(network_.points.size());
    network_.points.push_back(p);
    network_.points.push_back(q);
    network_.segments.push_back({at, at + 1, Index(sources_.size())});
    sources_.push_back({role, shape, p, q});
  }

  Vec3 inside_at(const Vec3& a, const Vec3& b, double t) const {
    const Vec3 p = a + (b - a) * t;
    return {std::clamp(snap_to_line_lattice(p.x), 0.0, cols_ - 1.0),
            std::clamp(snap_to_line_lattice(p.y), 1.0 - rows_, 0.0), p.z};
  }

  /// Lines that cross the rim of a void are cut there: near lines, rims take part in the repair.
  void add_rims() {
    for (const Source& s : sources_) cells_.mark_along(s.a, s.b, 3);
    cells_.for_each_rim([&](const auto& p, const auto& q) {
      const bool side = (p[0] == q[0] && (p[0] == 0 || p[0] == cols_ - 1)) ||
                        (p[1] == q[1] && (p[1] == 0 || p[1] == rows_ - 1));
      if (!side)
        add_segment({double(p[0]), -double(p[1]), kNone}, {double(q[0]), -double(q[1]), kNone},
                    Role::rim, 0, nullptr);
    });
  }

  // --- repaired --------------------------------------------------------------------------------

  void measure_moves() {
    for (const LineSegment& s : network_.segments) {
      const Source& from = sources_[s.source];
      if (from.role == Role::rim) continue;
      for (const Index v : {s.a, s.b}) {
        const Vec3& p = network_.points[v];
        const double l2 = squared_xy(from.a, from.b);
        const double t = std::clamp(
            ((p.x - from.a.x) * (from.b.x - from.a.x) + (p.y - from.a.y) * (from.b.y - from.a.y)) /
                l2,
            0.0, 1.0);
        const bool exact = exact_orient(from.a, from.b, p) == 0 && t > 0 && t < 1;
        const double d = exact ? 0 : std::sqrt(squared_xy(p, from.a + (from.b - from.a) * t));
        report_.moved_posts = std::max(report_.moved_posts, d);
      }
    }
  }

  /// Segments of all sources, each stretch once; polygons by the stretches that bound them an odd
  /// number of times.
  void find_parts() {
    out_.flat_points.resize(shapes_.flatten.size());
    std::vector<std::vector<PolygonSet::Edge>> flat = std::move(beyond_flat_);
    std::vector<std::vector<PolygonSet::Edge>> boundary = std::move(beyond_boundary_);
    const auto& all = network_.segments;  // in order of their ends
    std::map<Index, int> in_flat, in_boundary;
    for (std::size_t i = 0; i < all.size();) {
      const Index a = all[i].a, b = all[i].b;
      NetworkPart part{a, b, false, false, {}};
      in_flat.clear(), in_boundary.clear();
      std::size_t sharing = 0;
      for (; i < all.size() && all[i].a == a && all[i].b == b; ++i) {
        const Source& s = sources_[all[i].source];
        if (s.role == Role::rim) continue;
        part.line = true;
        ++sharing;
        part.own_heights |= s.role == Role::breakline && !std::isnan(s.a.z) && !std::isnan(s.b.z);
        if (s.role == Role::flatten) ++in_flat[s.shape];
        if (s.role == Role::boundary) ++in_boundary[s.shape];
      }
      report_.overlaps += sharing > 1;
      const Vec3 &p = network_.points[a], &q = network_.points[b];
      for (const auto& [shape, times] : in_flat) {
        out_.flat_points[shape].push_back(a);
        out_.flat_points[shape].push_back(b);
        if (times % 2) flat[shape].push_back({{p.x, p.y}, {q.x, q.y}});
      }
      for (const auto& [shape, times] : in_boundary)
        if (times % 2) boundary[shape].push_back({{p.x, p.y}, {q.x, q.y}});
      if (part.line) part.inner = divide(p, q);
      out_.parts.push_back(std::move(part));
    }
    for (auto& edges : flat) out_.flat.add(std::move(edges));
    for (auto& edges : boundary) out_.boundary.add(std::move(edges));
  }

  /// Points on a part: posts that lie on it exactly, and its halves, quarters ... where no post is.
  std::vector<Vec3> divide(const Vec3& a, const Vec3& b) const {
    std::vector<std::pair<double, Vec3>> at;  // by the share of the way
    const double dx = b.x - a.x, dy = b.y - a.y;
    const bool wide = std::abs(dx) >= std::abs(dy);
    const double lo = wide ? std::min(a.x, b.x) : std::min(a.y, b.y);
    const double hi = wide ? std::max(a.x, b.x) : std::max(a.y, b.y);
    for (double k = std::ceil(lo); k <= hi; ++k) {
      const double t = wide ? (k - a.x) / dx : (k - a.y) / dy;
      const double other = std::nearbyint(wide ? a.y + t * dy : a.x + t * dx);
      const Vec3 post = wide ? Vec3{k, other, kNone} : Vec3{other, k, kNone};
      if (on_segment(a, b, post) && cells_.valid(int(post.x), int(-post.y)))
        at.push_back({t, post});
    }
    const std::size_t posts = at.size();
    const double long_ = std::sqrt(dx * dx + dy * dy);
    int halvings = 0;
    while (halvings < kHalvings && long_ / double(1 << halvings) > kPiece) ++halvings;
    std::size_t next = 0;
    for (int k = 1; k < 1 << halvings; ++k) {
      const double t = k / double(1 << halvings);
      while (next < posts && at[next].first < t && (t - at[next].first) * long_ > 0.5 &&
             at[next].first * long_ + 0.5 < t * long_)
        ++next;
      if (next < posts && std::abs(at[next].first - t) * long_ <= 0.5) continue;
      at.push_back({t, {a.x + dx * t, a.y + dy * t, kNone}});
    }
    std::sort(at.begin(), at.end(), [](const auto& p, const auto& q) { return p.first < q.first; });
    std::vector<Vec3> inner;
    inner.reserve(at.size());
    for (const auto& [t, p] : at) inner.push_back(p);
    return inner;
  }
};

}  // namespace

Result<ConstraintNetwork> constraint_network(const HeightGrid& grid, const ConstraintShapes& shapes,
                                             ConstraintReport& report) {
  return NetworkBuilder(grid, shapes, report).build();
}

}  // namespace tind
