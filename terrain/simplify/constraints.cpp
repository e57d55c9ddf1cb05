// Shapes are clipped to the DEM's rectangle, repaired into a network (constrained_delaunay.h), and
// each straight part of it is divided into halves, quarters ... down to about a post, so that the
// ground under it is followed; such points lie on the part exactly. Only cells near lines are
// triangulated anew, with the parts as edges; all other cells keep their two triangles.

#include "terrain/simplify/constraints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_map>

#include "terrain/mesh/manifold.h"

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

double squared(const Vec3& a, const Vec3& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

/// Exact for coordinates that are multiples of 2^-36 below 2^26.
__int128 exact_orient(const Vec3& a, const Vec3& b, const Vec3& p) {
  const auto units = [](double v) { return __int128(std::int64_t(v * 0x1p36)); };
  return (units(b.x) - units(a.x)) * (units(p.y) - units(a.y)) -
         (units(b.y) - units(a.y)) * (units(p.x) - units(a.x));
}
bool between(const Vec3& a, const Vec3& b, const Vec3& p) {
  return (p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y) > 0 &&
         (p.x - b.x) * (a.x - b.x) + (p.y - b.y) * (a.y - b.y) > 0;
}
bool on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  return exact_orient(a, b, p) == 0 && between(a, b, p);
}

class Builder {
 public:
  Builder(const HeightGrid& grid, const ConstraintShapes& shapes)
      : source_grid_(grid), shapes_(shapes), cols_(grid.cols()), rows_(grid.rows()) {
    out_.grid = grid;
    out_.flat = PolygonSet(rows_);
    boundary_ = PolygonSet(rows_);
  }

  Result<Constraints> build() {
    gather();
    add_rims();
    const auto repairs = repair_lines(network_);
    if (!repairs) return std::unexpected(repairs.error());
    out_.report.repairs = *repairs;
    measure_moves();
    find_parts();
    find_levels();
    cut_outside();
    give_heights();
    if (const auto ok = make_mesh(); !ok) return std::unexpected(ok.error());
    keep_parts();
    return std::move(out_);
  }

 private:
  const HeightGrid& source_grid_;
  const ConstraintShapes& shapes_;
  const int cols_, rows_;
  Constraints out_;
  PolygonSet boundary_;
  LineNetwork network_;
  std::vector<Source> sources_;
  /// Edges of each polygon outside the rectangle: they only tell inside from outside.
  std::vector<std::vector<PolygonSet::Edge>> beyond_flat_, beyond_boundary_;

  struct Part {
    Index a, b;  // points of the network
    bool line;   // not only the rim of a void
    bool own_heights;
    std::vector<Vec3> inner;
  };
  std::vector<Part> parts_;
  std::vector<std::vector<Index>> flat_points_;  // network points on each polygon's outline
  std::vector<std::uint8_t> touched_;            // by cell

  // --- what was given --------------------------------------------------------------------------

  void gather() {
    ConstraintReport& r = out_.report;
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
      out_.report.not_finite += !usable;
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
        out_.report.without_length += !(beyond && closing);
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
    const bool meets = cut(a.x, b.x - a.x, 0, cols_ - 1) & cut(a.y, b.y - a.y, 1 - rows_, 0);
    if (!meets || !(t0 < t1)) {
      out_.report.outside += role != Role::rim;
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

  // --- cells -----------------------------------------------------------------------------------

  bool valid(int c, int r) const { return !source_grid_.is_void(c, r); }
  std::size_t cell(int c, int r) const {
    return std::size_t(r) * std::size_t(cols_ - 1) + std::size_t(c);
  }

  void touch(const Vec3& a, const Vec3& b, int around) {
    const int c0 = int(std::floor(std::min(a.x, b.x))) - around,
              c1 = int(std::floor(std::max(a.x, b.x))) + around;
    const int r0 = int(std::floor(-std::max(a.y, b.y))) - around,
              r1 = int(std::floor(-std::min(a.y, b.y))) + around;
    for (int r = std::max(0, r0); r <= std::min(rows_ - 2, r1); ++r)
      for (int c = std::max(0, c0); c <= std::min(cols_ - 2, c1); ++c) touched_[cell(c, r)] = 1;
  }

  /// What of a cell the DEM covers: 4 corners, the 3 valid ones, or nothing.
  std::vector<std::array<int, 2>> covered(int c, int r) const {
    std::vector<std::array<int, 2>> corners;
    for (const auto& [dc, dr] : {std::array{0, 0}, {0, 1}, {1, 1}, {1, 0}})  // counter-clockwise
      if (valid(c + dc, r + dr)) corners.push_back({c + dc, r + dr});
    if (corners.size() < 3) corners.clear();
    return corners;
  }

  /// Edges between what is covered and what is not, of touched cells: f(corner, corner).
  template <class F>
  void for_each_rim(F&& f) const {
    for (int r = 0; r + 1 < rows_; ++r) {
      for (int c = 0; c + 1 < cols_; ++c) {
        if (!touched_[cell(c, r)]) continue;
        const auto corners = covered(c, r);
        for (std::size_t k = 0; k < corners.size(); ++k) {
          const auto &p = corners[k], &q = corners[(k + 1) % corners.size()];
          if (is_rim(c, r, p, q)) f(p, q);
        }
      }
    }
  }
  bool is_rim(int c, int r, const std::array<int, 2>& p, const std::array<int, 2>& q) const {
    if (p[0] != q[0] && p[1] != q[1]) return true;  // across a cell with one void
    int dc = 0, dr = 0;
    if (p[0] == q[0])
      dc = p[0] == c ? -1 : 1;
    else
      dr = p[1] == r ? -1 : 1;
    const int nc = c + dc, nr = r + dr;
    if (nc < 0 || nr < 0 || nc > cols_ - 2 || nr > rows_ - 2) return true;
    return !touched_[cell(nc, nr)] || covered(nc, nr).empty();
  }

  /// Lines that cross the rim of a void are cut there: near lines, rims take part in the repair.
  void add_rims() {
    touched_.assign(std::size_t(cols_ - 1) * std::size_t(rows_ - 1), 0);
    bool voids = false;
    for (const float z : source_grid_.values()) voids |= std::isnan(z);
    if (!voids) return;
    for (const Source& s : sources_) touch_along(s.a, s.b, 3);
    for_each_rim([&](const auto& p, const auto& q) {
      const bool side = (p[0] == q[0] && (p[0] == 0 || p[0] == cols_ - 1)) ||
                        (p[1] == q[1] && (p[1] == 0 || p[1] == rows_ - 1));
      if (!side)
        add_segment({double(p[0]), -double(p[1]), kNone}, {double(q[0]), -double(q[1]), kNone},
                    Role::rim, 0, nullptr);
    });
    touched_.assign(touched_.size(), 0);
  }
  void touch_along(const Vec3& a, const Vec3& b, int around) {
    const int n = int(std::sqrt(squared(a, b))) + 1;
    for (int i = 0; i < n; ++i)
      touch(a + (b - a) * (double(i) / n), a + (b - a) * (double(i + 1) / n), around);
  }

  // --- the network -----------------------------------------------------------------------------

  void measure_moves() {
    for (const LineSegment& s : network_.segments) {
      const Source& from = sources_[s.source];
      if (from.role == Role::rim) continue;
      for (const Index v : {s.a, s.b}) {
        const Vec3& p = network_.points[v];
        const double l2 = squared(from.a, from.b);
        const double t = std::clamp(
            ((p.x - from.a.x) * (from.b.x - from.a.x) + (p.y - from.a.y) * (from.b.y - from.a.y)) /
                l2,
            0.0, 1.0);
        const bool exact = exact_orient(from.a, from.b, p) == 0 && t > 0 && t < 1;
        const double d = exact ? 0 : std::sqrt(squared(p, from.a + (from.b - from.a) * t));
        out_.report.moved_posts = std::max(out_.report.moved_posts, d);
      }
    }
  }

  /// Segments of all sources, each stretch once; polygons by the stretches that bound them an odd
  /// number of times.
  void find_parts() {
    flat_points_.resize(shapes_.flatten.size());
    std::vector<std::vector<PolygonSet::Edge>> flat = std::move(beyond_flat_);
    std::vector<std::vector<PolygonSet::Edge>> boundary = std::move(beyond_boundary_);
    const auto& all = network_.segments;  // in order of their ends
    std::map<Index, int> in_flat, in_boundary;
    for (std::size_t i = 0; i < all.size();) {
      const Index a = all[i].a, b = all[i].b;
      Part part{a, b, false, false, {}};
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
      out_.report.overlaps += sharing > 1;
      const Vec3 &p = network_.points[a], &q = network_.points[b];
      for (const auto& [shape, times] : in_flat) {
        flat_points_[shape].push_back(a);
        flat_points_[shape].push_back(b);
        if (times % 2) flat[shape].push_back({{p.x, p.y}, {q.x, q.y}});
      }
      for (const auto& [shape, times] : in_boundary)
        if (times % 2) boundary[shape].push_back({{p.x, p.y}, {q.x, q.y}});
      if (part.line) part.inner = divide(p, q);
      parts_.push_back(std::move(part));
    }
    for (auto& edges : flat) out_.flat.add(std::move(edges));
    for (auto& edges : boundary) boundary_.add(std::move(edges));
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
      if (on_segment(a, b, post) && valid(int(post.x), int(-post.y))) at.push_back({t, post});
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
    for (const auto& [t, p] : at) inner.push_back(p);
    return inner;
  }

  // --- heights ---------------------------------------------------------------------------------

  /// Bilinear; over three corners where one is void, the mean of what is left otherwise; NaN far
  /// from any valid post.
  double dem_height(double x, double y) const {
    const int c = std::clamp(int(x), 0, cols_ - 2), r = std::clamp(int(-y), 0, rows_ - 2);
    const double fx = x - c, fy = -y - r;
    const double w[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    double z[4], sum = 0, share = 0;
    int voids = 0, missing = 0;
    for (int k = 0; k < 4; ++k) {
      z[k] = source_grid_.at(c + k % 2, r + k / 2);
      if (std::isnan(z[k])) {
        ++voids, missing = k;
      } else {
        sum += w[k] * z[k], share += w[k];
      }
    }
    if (voids == 0) return sum;
    if (voids == 1 && w[missing] > 0) {
      const int o = 3 - missing;  // the opposite corner; the void one completes its parallelogram
      double filled = -z[o];
      for (int k = 0; k < 4; ++k)
        if (k != missing && k != o) filled += z[k];
      return sum + w[missing] * filled;
    }
    return share > 0 ? sum / share : kNone;
  }

  static double median(std::vector<double> v) {
    if (v.empty()) return kNone;
    const auto middle = v.begin() + std::ptrdiff_t(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
  }

  double own_level(Index shape) const {
    std::vector<double> heights;
    for (const VectorLine& ring : shapes_.flatten[shape].rings)
      for (const Vec3& p : ring)
        if (std::isfinite(p.z)) heights.push_back(p.z);
    if (!heights.empty()) return median(std::move(heights));
    out_.flat.fill(shape, cols_, [&](int r, int c0, int c1) {
      for (int c = c0; c <= c1; ++c)
        if (valid(c, r)) heights.push_back(source_grid_.at(c, r));
    });
    if (!heights.empty()) return median(std::move(heights));
    for (const Index v : flat_points_[shape]) {
      const double h = dem_height(network_.points[v].x, network_.points[v].y);
      if (!std::isnan(h)) heights.push_back(h);
    }
    return median(std::move(heights));
  }

  void find_levels() {
    const std::size_t n = shapes_.flatten.size();
    std::vector<Index> group(n);
    std::iota(group.begin(), group.end(), 0);
    const auto root = [&](Index i) {
      while (group[i] != i) i = group[i] = group[group[i]];
      return i;
    };
    std::unordered_map<Index, Index> first;  // point -> a polygon that has it
    for (Index i = 0; i < n; ++i) {
      for (const Index v : flat_points_[i]) {
        const auto [there, is_new] = first.try_emplace(v, i);
        if (!is_new) group[root(i)] = root(there->second);
        const Index in = out_.flat.holding(network_.points[v].x, network_.points[v].y);
        if (in != PolygonSet::kNone && !on_outline(in, v)) group[root(i)] = root(in);
      }
    }
    out_.level.assign(n, kNone);
    std::vector<double> lowest(n, kNone);
    for (Index i = 0; i < n; ++i) {
      const double own = own_level(i);
      double& l = lowest[root(i)];
      if (std::isnan(l) || own < l) l = own;
    }
    for (Index i = 0; i < n; ++i) {
      const double l = double(float(lowest[root(i)]));
      out_.level[i] = std::isnan(l) ? 0 : l;
      out_.flat.fill(i, cols_, [&](int r, int c0, int c1) {
        for (int c = c0; c <= c1; ++c) flatten_post(c, r, out_.level[i]);
      });
    }
  }
  bool on_outline(Index polygon, Index v) const {
    return std::ranges::find(flat_points_[polygon], v) != flat_points_[polygon].end();
  }
  void flatten_post(int c, int r, double level) {
    if (out_.grid.is_void(c, r)) return;
    out_.grid.at(c, r) = float(level);
    ++out_.report.posts_flattened;
  }

  void cut_outside() {
    if (shapes_.boundary.empty()) return;
    HeightGrid inside(cols_, rows_);
    const auto keep = [&](int c, int r) { inside.at(c, r) = out_.grid.at(c, r); };
    for (Index i = 0; i < boundary_.size(); ++i)
      boundary_.fill(i, cols_, [&](int r, int c0, int c1) {
        for (int c = c0; c <= c1; ++c) keep(c, r);
      });
    for_each_line_post([&](int c, int r, const Part& p) {
      if (is_boundary(p)) keep(c, r);
    });
    for (std::size_t i = 0; i < inside.size(); ++i)
      out_.report.posts_outside +=
          std::isnan(inside.values()[i]) && !std::isnan(out_.grid.values()[i]);
    out_.grid = std::move(inside);
  }
  /// A part whose two sides are not both inside or both outside.
  bool is_boundary(const Part& p) const {
    const Vec3 &a = network_.points[p.a], &b = network_.points[p.b];
    const Vec3 m = (a + b) * 0.5, d = (b - a) * (1e-6 / std::sqrt(squared(a, b)));
    return (boundary_.holding(m.x - d.y, m.y + d.x) != PolygonSet::kNone) !=
           (boundary_.holding(m.x + d.y, m.y - d.x) != PolygonSet::kNone);
  }
  template <class F>
  void for_each_line_post(F&& f) {
    const auto visit = [&](const Vec3& p, const Part& part) {
      if (p.x == std::floor(p.x) && p.y == std::floor(p.y)) f(int(p.x), int(-p.y), part);
    };
    for (const Part& part : parts_) {
      if (!part.line) continue;
      visit(network_.points[part.a], part), visit(network_.points[part.b], part);
      for (const Vec3& p : part.inner) visit(p, part);
    }
  }

  void give_heights() {
    std::vector<double> level(network_.points.size(), kNone);
    for (Index i = 0; i < flat_points_.size(); ++i)
      for (const Index v : flat_points_[i]) level[v] = out_.level[i];
    for (Index v = 0; v < level.size(); ++v) {
      Vec3& p = network_.points[v];
      if (std::isnan(level[v])) level[v] = flat_level(p.x, p.y);
      if (!std::isnan(level[v])) p.z = level[v];
      if (std::isnan(p.z)) p.z = dem_height(p.x, p.y);
    }
    for (Part& part : parts_) {
      const Vec3 &a = network_.points[part.a], &b = network_.points[part.b];
      const Vec3 m = (a + b) * 0.5;
      double flat = flat_level(m.x, m.y);
      if (std::isnan(flat) && on_same_outline(part)) flat = a.z;
      for (Vec3& p : part.inner) {
        const bool is_post = p.x == std::floor(p.x) && p.y == std::floor(p.y);
        if (is_post && !std::isnan(flat)) flatten_post(int(p.x), int(-p.y), flat);
        const double t = std::sqrt(squared(a, p) / squared(a, b));
        p.z = !std::isnan(flat)  ? flat
              : part.own_heights ? a.z + t * (b.z - a.z)
                                 : dem_height(p.x, p.y);
      }
    }
  }
  double flat_level(double x, double y) const {
    const Index in = out_.flat.size() ? out_.flat.holding(x, y) : PolygonSet::kNone;
    return in == PolygonSet::kNone ? kNone : out_.level[in];
  }
  /// A part of an outline; a hair to one of its sides the polygon begins.
  bool on_same_outline(const Part& p) const {
    if (out_.flat.size() == 0) return false;
    const Vec3 &a = network_.points[p.a], &b = network_.points[p.b];
    const Vec3 m = (a + b) * 0.5, d = (b - a) * (1e-6 / std::sqrt(squared(a, b)));
    return !std::isnan(flat_level(m.x - d.y, m.y + d.x)) ||
           !std::isnan(flat_level(m.x + d.y, m.y - d.x));
  }

  // --- the mesh --------------------------------------------------------------------------------

  Index post(int c, int r) const {
    return Index(std::size_t(r) * std::size_t(cols_) + std::size_t(c));
  }

  Result<void> make_mesh() {
    Tin& mesh = out_.mesh;
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < cols_; ++c)
        mesh.vertices.push_back({double(c), -double(r), double(out_.grid.at(c, r))});
    if (const auto ok = triangulate_near_lines(); !ok) return ok;
    for (int r = 0; r + 1 < rows_; ++r)
      for (int c = 0; c + 1 < cols_; ++c)
        if (!touched_[cell(c, r)]) add_cell(c, r);
    if (mesh.triangles.empty())
      return fail(Errc::bad_data, "nothing of the DEM is left inside the boundary");
    const std::size_t before = mesh.vertices.size();
    make_manifold(mesh);
    out_.hold.resize(mesh.vertices.size(), Constraints::stays);
    if (mesh.vertices.size() > before) hold_copies(before);
    return {};
  }

  /// Where fans meet in one vertex, that is two now: neither may move.
  void hold_copies(std::size_t before) {
    std::map<std::pair<double, double>, int> copied;
    for (std::size_t v = before; v < out_.mesh.vertices.size(); ++v)
      copied[{out_.mesh.vertices[v].x, out_.mesh.vertices[v].y}] = 1;
    for (std::size_t v = 0; v < before; ++v)
      if (copied.contains({out_.mesh.vertices[v].x, out_.mesh.vertices[v].y}))
        out_.hold[v] = Constraints::stays;
  }

  void add_cell(int c, int r) {
    const auto is = [&](int dc, int dr) { return !out_.grid.is_void(c + dc, r + dr); };
    const Index nw = post(c, r), ne = post(c + 1, r), sw = post(c, r + 1), se = post(c + 1, r + 1);
    auto& out = out_.mesh.triangles;
    if (is(0, 0) && is(0, 1) && is(1, 0)) out.push_back({nw, sw, ne});
    if (is(1, 1) && is(1, 0) && is(0, 1)) out.push_back({se, ne, sw});
    if (!is(1, 0) && is(0, 0) && is(0, 1) && is(1, 1)) out.push_back({nw, sw, se});
    if (!is(0, 1) && is(0, 0) && is(1, 0) && is(1, 1)) out.push_back({nw, se, ne});
  }

  /// The triangulation of the touched cells; points are given to it with their vertex of the mesh.
  Result<void> triangulate_near_lines() {
    Tin& mesh = out_.mesh;
    out_.hold.assign(mesh.vertices.size(), Constraints::loose);
    const auto [line_vertex, chains] = enter_lines();
    const std::vector<std::uint8_t> left_out = posts_too_near();
    std::vector<Vec3> points;
    std::vector<Index> vertex, place(mesh.vertices.size(), PolygonSet::kNone);
    const auto enter = [&](Index v) {
      if (place[v] != PolygonSet::kNone) return;
      place[v] = Index(points.size());
      points.push_back(mesh.vertices[v]);
      vertex.push_back(v);
    };
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < cols_; ++c)
        if (valid(c, r) && near_line(c, r) && !left_out[post(c, r)]) enter(post(c, r));
    std::vector<std::array<Index, 2>> edges;
    for (const std::vector<Index>& chain : chains) {
      for (const Index v : chain) enter(v);
      for (std::size_t k = 1; k < chain.size(); ++k)
        edges.push_back({place[chain[k - 1]], place[chain[k]]});
    }
    for_each_rim([&](const auto& p, const auto& q) {
      enter(post(p[0], p[1])), enter(post(q[0], q[1]));
      edges.push_back({place[post(p[0], p[1])], place[post(q[0], q[1])]});
    });
    const auto triangles = triangulate(points, edges);
    if (!triangles) return std::unexpected(triangles.error());
    for (std::size_t i = vertex.size(); i < points.size(); ++i) {
      vertex.push_back(Index(mesh.vertices.size()));
      mesh.vertices.push_back({points[i].x, points[i].y, dem_height(points[i].x, points[i].y)});
      out_.hold.push_back(Constraints::stays);
    }
    for (const Triangle& t : *triangles) {
      const Triangle v = {vertex[t[0]], vertex[t[1]], vertex[t[2]]};
      if (belongs(v)) mesh.triangles.push_back(v);
    }
    return {};
  }

  bool near_line(int c, int r) const {
    for (int dr = -1; dr <= 0; ++dr)
      for (int dc = -1; dc <= 0; ++dc)
        if (c + dc >= 0 && r + dr >= 0 && c + dc < cols_ - 1 && r + dr < rows_ - 1 &&
            touched_[cell(c + dc, r + dr)])
          return true;
    return false;
  }

  /// Gives the network its vertices in the mesh (posts are their own) and marks the cells around.
  std::pair<std::vector<Index>, std::vector<std::vector<Index>>> enter_lines() {
    Tin& mesh = out_.mesh;
    const auto vertex_of = [&](const Vec3& p, Constraints::Hold hold) {
      const bool is_post =
          p.x == std::floor(p.x) && p.y == std::floor(p.y) && valid(int(p.x), int(-p.y));
      if (!is_post) mesh.vertices.push_back(p), out_.hold.push_back(hold);
      const Index v = is_post ? post(int(p.x), int(-p.y)) : Index(mesh.vertices.size() - 1);
      if (is_post) {
        if (!std::isnan(mesh.vertices[v].z)) mesh.vertices[v].z = p.z;
        out_.hold[v] = hold;
      }
      return v;
    };
    std::vector<Index> of(network_.points.size(), PolygonSet::kNone);
    std::vector<std::vector<Index>> chains;
    for (const Part& part : parts_) {
      for (const Index p : {part.a, part.b})
        if (of[p] == PolygonSet::kNone) of[p] = vertex_of(network_.points[p], Constraints::stays);
      std::vector<Index> chain = {of[part.a]};
      for (const Vec3& p : part.inner)
        if (!std::isnan(p.z)) chain.push_back(vertex_of(p, Constraints::slides));
      chain.push_back(of[part.b]);
      for (std::size_t k = 1; k < chain.size(); ++k)
        touch_along(mesh.vertices[chain[k - 1]], mesh.vertices[chain[k]], 1);
      if (part.line) {
        LinePart kept{of[part.a], of[part.b], out_.inner.size(), 0};
        out_.inner.insert(out_.inner.end(), chain.begin() + 1, chain.end() - 1);
        kept.last = out_.inner.size();
        out_.parts.push_back(kept);
      }
      chains.push_back(std::move(chain));
    }
    return {std::move(of), std::move(chains)};
  }

  /// Posts within the tolerance of a line but not on it: as vertices they would make needles.
  std::vector<std::uint8_t> posts_too_near() const {
    std::vector<std::uint8_t> left_out(source_grid_.size(), 0);
    for (const Part& part : parts_) {
      const Vec3 &a = network_.points[part.a], &b = network_.points[part.b];
      const double l = std::sqrt(squared(a, b));
      const bool wide = std::abs(b.x - a.x) >= std::abs(b.y - a.y);
      const double lo = wide ? std::min(a.x, b.x) : std::min(a.y, b.y);
      const double hi = wide ? std::max(a.x, b.x) : std::max(a.y, b.y);
      for (double k = std::ceil(lo - kLineTolerance); k <= hi + kLineTolerance; ++k) {
        const double t =
            std::clamp(wide ? (k - a.x) / (b.x - a.x) : (k - a.y) / (b.y - a.y), 0.0, 1.0);
        const double other = std::nearbyint(wide ? a.y + t * (b.y - a.y) : a.x + t * (b.x - a.x));
        const Vec3 p = wide ? Vec3{k, other, 0} : Vec3{other, k, 0};
        const int c = int(p.x), r = int(-p.y);
        if (c <= 0 || r <= 0 || c >= cols_ - 1 || r >= rows_ - 1) continue;  // sides stay whole
        if ((p.x == a.x && p.y == a.y) || (p.x == b.x && p.y == b.y) || on_segment(a, b, p))
          continue;
        const bool beside = between(a, b, p) && std::abs(orient2d(a, b, p)) / l <= kLineTolerance;
        const double near2 = std::min(squared(a, p), squared(b, p));
        left_out[post(c, r)] |= beside || near2 <= kLineTolerance * kLineTolerance;
      }
    }
    return left_out;
  }

  /// Of the DEM, and inside the boundary?
  bool belongs(const Triangle& t) const {
    const auto& v = out_.mesh.vertices;
    const Vec3 m = (v[t[0]] + v[t[1]] + v[t[2]]) * (1.0 / 3);
    const int c = std::clamp(int(m.x), 0, cols_ - 2), r = std::clamp(int(-m.y), 0, rows_ - 2);
    if (!touched_[cell(c, r)]) return false;
    const auto corners = covered(c, r);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const auto &p = corners[k], &q = corners[(k + 1) % corners.size()];
      if (orient2d({double(p[0]), -double(p[1]), 0}, {double(q[0]), -double(q[1]), 0}, m) < 0)
        return false;
    }
    if (corners.empty()) return false;
    return shapes_.boundary.empty() || boundary_.holding(m.x, m.y) != PolygonSet::kNone;
  }

  // --- what holds ------------------------------------------------------------------------------

  /// Leaves out the parts that no triangle has as its edge.
  void keep_parts() {
    Tin& mesh = out_.mesh;
    std::unordered_map<std::uint64_t, int> edge;
    const auto key = [](Index a, Index b) {
      return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
    };
    for (const Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const Index a = t[std::size_t(k)], b = t[std::size_t(k + 1) % 3];
        if (out_.hold[a] != Constraints::loose && out_.hold[b] != Constraints::loose)
          ++edge[key(a, b)];
      }
    std::vector<LinePart> kept;
    for (const LinePart& part : out_.parts) {
      const Index next = part.first < part.last ? out_.inner[part.first] : part.b;
      if (!edge.contains(key(part.a, next))) {
        ++out_.report.outside;
        continue;
      }
      kept.push_back(part);
    }
    out_.parts = std::move(kept);
    out_.report.parts = out_.parts.size();
  }
};

/// Neighbours of each vertex.
struct Neighbours {
  std::vector<std::size_t> start;
  std::vector<Index> all;
  explicit Neighbours(const Tin& tin) : start(tin.vertices.size() + 1, 0) {
    for (const Triangle& t : tin.triangles)
      for (const Index v : t) start[v + 1] += 2;
    std::partial_sum(start.begin(), start.end(), start.begin());
    all.resize(start.back());
    std::vector<std::size_t> fill(start.begin(), start.end() - 1);
    for (const Triangle& t : tin.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        all[fill[t[k]]++] = t[(k + 1) % 3];
        all[fill[t[k]]++] = t[(k + 2) % 3];
      }
  }
};

}  // namespace

Result<Constraints> constrain(const HeightGrid& grid, const ConstraintShapes& shapes) {
  if (grid.cols() < 2 || grid.rows() < 2 || grid.cols() > 32768 || grid.rows() > 32768) {
    return fail(Errc::out_of_range,
                "lines need a DEM of 2 x 2 to 32768 x 32768 posts: cut it to a part first");
  }
  return Builder(grid, shapes).build();
}

ConstraintCheck check_constraints(const Tin& tin, const Constraints& constraints) {
  ConstraintCheck check;
  std::map<std::pair<double, double>, Index> at;
  for (Index v = 0; v < tin.vertices.size(); ++v) at[{tin.vertices[v].x, tin.vertices[v].y}] = v;
  const Neighbours near(tin);
  const auto holds = [&](const Vec3& a, const Vec3& b) {
    const auto from = at.find({a.x, a.y}), to = at.find({b.x, b.y});
    if (from == at.end() || to == at.end()) return false;
    for (Index v = from->second; v != to->second;) {
      Index next = v;
      for (std::size_t k = near.start[v]; k < near.start[v + 1]; ++k) {
        const Vec3& p = tin.vertices[near.all[k]];
        const bool ahead = (p.x == b.x && p.y == b.y) || on_segment(tin.vertices[v], b, p);
        if (ahead && (next == v || near.all[k] == to->second)) next = near.all[k];
      }
      if (next == v) return false;
      v = next;
    }
    return true;
  };
  for (const LinePart& part : constraints.parts) {
    ++check.parts;
    check.missing += !holds(constraints.mesh.vertices[part.a], constraints.mesh.vertices[part.b]);
  }
  if (constraints.flat.size() == 0) return check;
  for (const Triangle& t : tin.triangles) {
    const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
    const Vec3 m = (a + b + c) * (1.0 / 3);
    const Index in = constraints.flat.holding(m.x, m.y);
    if (in == PolygonSet::kNone) continue;
    const double l = constraints.level[in];
    check.not_level += a.z != l || b.z != l || c.z != l;
  }
  return check;
}

void set_level(Tin& tin, const Constraints& constraints) {
  if (constraints.flat.size() == 0) return;
  for (Vec3& v : tin.vertices) {
    const Index in = constraints.flat.holding(v.x, v.y);
    if (in != PolygonSet::kNone && std::abs(v.z - constraints.level[in]) < 1e-6)
      v.z = constraints.level[in];
  }
}

}  // namespace tind
