#include "terrain/simplify/constraints/constraint_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "terrain/base/median.h"
#include "terrain/mesh/exact_line.h"
#include "terrain/raster/interpolate.h"

namespace tind {

namespace {

using Index = std::uint32_t;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

class HeightGiver {
 public:
  HeightGiver(const HeightGrid& grid, const ConstraintShapes& shapes, ConstraintNetwork& net,
              Constraints& out)
      : grid_(grid), shapes_(shapes), net_(net), out_(out), cols_(grid.cols()) {}

  void run() {
    find_levels();
    cut_outside();
    give_heights();
  }

 private:
  const HeightGrid& grid_;
  const ConstraintShapes& shapes_;
  ConstraintNetwork& net_;
  Constraints& out_;
  const int cols_;
  std::vector<bool> flattened_ = std::vector<bool>(grid_.size());

  double own_level(Index shape) const {
    std::vector<double> heights = own_heights(shapes_.flatten[shape]);
    if (!heights.empty()) return median(std::move(heights));
    net_.flat.fill(shape, cols_, [&](int r, int c0, int c1) {
      for (int c = c0; c <= c1; ++c)
        if (!grid_.is_void(c, r)) heights.push_back(grid_.at(c, r));
    });
    if (!heights.empty()) return median(std::move(heights));
    for (const Index v : net_.flat_points[shape]) {
      const double h = height_between_posts(grid_, net_.points[v].x, net_.points[v].y);
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
      for (const Index v : net_.flat_points[i]) {
        const auto [there, is_new] = first.try_emplace(v, i);
        if (!is_new) group[root(i)] = root(there->second);
        const Index in = net_.flat.holding(net_.points[v].x, net_.points[v].y);
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
      net_.flat.fill(i, cols_, [&](int r, int c0, int c1) {
        for (int c = c0; c <= c1; ++c) flatten_post(c, r, out_.level[i]);
      });
    }
  }
  bool on_outline(Index polygon, Index v) const {
    return std::ranges::find(net_.flat_points[polygon], v) != net_.flat_points[polygon].end();
  }
  void flatten_post(int c, int r, double level) {
    if (out_.dem.grid.is_void(c, r)) return;
    out_.dem.grid.at(c, r) = float(level);
    auto&& counted = flattened_[std::size_t(r) * std::size_t(cols_) + std::size_t(c)];
    out_.report.posts_flattened += !counted;  // those on shores are met more than once
    counted = true;
  }

  void cut_outside() {
    if (shapes_.boundary.empty()) return;
    HeightGrid inside(cols_, grid_.rows());
    const auto keep = [&](int c, int r) { inside.at(c, r) = out_.dem.grid.at(c, r); };
    for (Index i = 0; i < net_.boundary.size(); ++i)
      net_.boundary.fill(i, cols_, [&](int r, int c0, int c1) {
        for (int c = c0; c <= c1; ++c) keep(c, r);
      });
    for_each_line_post([&](int c, int r, const NetworkPart& p) {
      if (is_boundary(p)) keep(c, r);
    });
    for (std::size_t i = 0; i < inside.size(); ++i)
      out_.report.posts_outside +=
          std::isnan(inside.values()[i]) && !std::isnan(out_.dem.grid.values()[i]);
    out_.dem.grid = std::move(inside);
  }
  /// A part whose two sides are not both inside or both outside.
  bool is_boundary(const NetworkPart& p) const {
    const Vec3 &a = net_.points[p.a], &b = net_.points[p.b];
    const Vec3 m = (a + b) * 0.5, d = (b - a) * (1e-6 / std::sqrt(squared_xy(a, b)));
    return (net_.boundary.holding(m.x - d.y, m.y + d.x) != PolygonSet::kNone) !=
           (net_.boundary.holding(m.x + d.y, m.y - d.x) != PolygonSet::kNone);
  }
  static bool is_post(const Vec3& p) { return p.x == std::floor(p.x) && p.y == std::floor(p.y); }
  template <class F>
  void for_each_line_post(F&& f) {
    const auto visit = [&](const Vec3& p, const NetworkPart& part) {
      if (is_post(p)) f(int(p.x), int(-p.y), part);
    };
    for (const NetworkPart& part : net_.parts) {
      if (!part.line) continue;
      visit(net_.points[part.a], part), visit(net_.points[part.b], part);
      for (const Vec3& p : part.inner) visit(p, part);
    }
  }

  void give_heights() {
    std::vector<double> level(net_.points.size(), kNone);
    for (Index i = 0; i < net_.flat_points.size(); ++i)
      for (const Index v : net_.flat_points[i]) level[v] = out_.level[i];
    for (Index v = 0; v < level.size(); ++v) {
      Vec3& p = net_.points[v];
      if (std::isnan(level[v])) level[v] = flat_level(p.x, p.y);
      if (!std::isnan(level[v])) {
        p.z = level[v];
        if (is_post(p)) flatten_post(int(p.x), int(-p.y), level[v]);
      }
      if (std::isnan(p.z)) p.z = height_between_posts(grid_, p.x, p.y);
    }
    for (NetworkPart& part : net_.parts) {
      const Vec3 &a = net_.points[part.a], &b = net_.points[part.b];
      const Vec3 m = (a + b) * 0.5;
      double flat = flat_level(m.x, m.y);
      if (std::isnan(flat) && on_same_outline(part)) flat = a.z;
      for (Vec3& p : part.inner) {
        if (is_post(p) && !std::isnan(flat)) flatten_post(int(p.x), int(-p.y), flat);
        const double t = std::sqrt(squared_xy(a, p) / squared_xy(a, b));
        p.z = !std::isnan(flat)  ? flat
              : part.own_heights ? a.z + t * (b.z - a.z)
                                 : height_between_posts(grid_, p.x, p.y);
      }
    }
  }
  double flat_level(double x, double y) const {
    const Index in = net_.flat.size() ? net_.flat.holding(x, y) : PolygonSet::kNone;
    return in == PolygonSet::kNone ? kNone : out_.level[in];
  }
  /// A part of an outline; a hair to one of its sides the polygon begins.
  bool on_same_outline(const NetworkPart& p) const {
    if (net_.flat.size() == 0) return false;
    const Vec3 &a = net_.points[p.a], &b = net_.points[p.b];
    const Vec3 m = (a + b) * 0.5, d = (b - a) * (1e-6 / std::sqrt(squared_xy(a, b)));
    return !std::isnan(flat_level(m.x - d.y, m.y + d.x)) ||
           !std::isnan(flat_level(m.x + d.y, m.y - d.x));
  }
};

}  // namespace

double height_between_posts(const HeightGrid& grid, double x, double y) {
  const int c = std::clamp(int(x), 0, grid.cols() - 2), r = std::clamp(int(-y), 0, grid.rows() - 2);
  const double fx = x - c, fy = -y - r;
  double z[4];
  for (int k = 0; k < 4; ++k) z[k] = grid.at(c + k % 2, r + k / 2);
  const double measured = height_between(z[0], z[1], z[2], z[3], fx, fy);
  if (!std::isnan(measured)) return measured;
  const double w[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  double sum = 0, share = 0;
  int voids = 0, missing = 0;
  for (int k = 0; k < 4; ++k) {
    if (std::isnan(z[k])) {
      ++voids, missing = k;
    } else {
      sum += w[k] * z[k], share += w[k];
    }
  }
  if (voids == 1) {
    const int o = 3 - missing;  // the opposite corner; the void one completes its parallelogram
    double filled = -z[o];
    for (int k = 0; k < 4; ++k)
      if (k != missing && k != o) filled += z[k];
    return sum + w[missing] * filled;
  }
  return share > 0 ? sum / share : kNone;
}

void give_heights(const HeightGrid& grid, const ConstraintShapes& shapes, ConstraintNetwork& net,
                  Constraints& out) {
  HeightGiver(grid, shapes, net, out).run();
}

}  // namespace tind
