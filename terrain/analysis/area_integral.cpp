#include "terrain/analysis/area_integral.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "terrain/geo/ellipsoid.h"

namespace tind {
namespace {

/// x along an edge, a line in y.
struct Edge {
  Vec2 a, b;  // a.y < b.y
  double x_at(double y) const { return a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)); }
};

/// One along a row. Sides end there, in whichever cells they are, and so does the area in all
/// cells that it goes through.
struct FlatEdge {
  double y, west, east;
};

struct Edges {
  std::vector<Edge> sides;     // by a.y
  std::vector<FlatEdge> flat;  // by y
};

Edges edges_of(const PostRings& rings) {
  Edges edges;
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      Vec2 a = ring[i], b = ring[(i + 1) % ring.size()];
      if (!std::isfinite(a.x + a.y + b.x + b.y)) continue;
      if (a.y == b.y) {
        edges.flat.push_back({a.y, std::min(a.x, b.x), std::max(a.x, b.x)});
        continue;
      }
      if (a.y > b.y) std::swap(a, b);
      edges.sides.push_back({a, b});
    }
  std::ranges::sort(edges.sides, {}, [](const Edge& e) { return e.a.y; });
  std::ranges::sort(edges.flat, {}, &FlatEdge::y);
  return edges;
}

/// An edge in a row of cells: its x where it enters and leaves the row.
struct RowEdge {
  const Edge* edge;
  double low_y, high_y, west, east;
};

/// Corners of a cell and where D is defined: by four posts all of it, by three a triangle.
struct Cell {
  double z00, z10, z01, z11;
  double x, y;  // of its first post

  /// d0 + dx x + dy y + dxy x y, from the first post.
  double at(double fx, double fy) const {
    return z00 + (z10 - z00) * fx + (z01 - z00) * fy + (z11 - z10 - z01 + z00) * fx * fy;
  }
};

/// Which part of a cell has heights.
enum class Valid { all, none, west_of_falling, east_of_falling, west_of_rising, east_of_rising };

/// "Falling" is x = 1 - y, "rising" x = y, in the cell. Puts a fourth post on the plane of three.
Valid complete(Cell& c) {
  const int voids = std::isnan(c.z00) + std::isnan(c.z10) + std::isnan(c.z01) + std::isnan(c.z11);
  if (voids == 0) return Valid::all;
  if (voids > 1) return Valid::none;
  if (std::isnan(c.z00)) {
    c.z00 = c.z10 + c.z01 - c.z11;
    return Valid::east_of_falling;
  }
  if (std::isnan(c.z11)) {
    c.z11 = c.z10 + c.z01 - c.z00;
    return Valid::west_of_falling;
  }
  if (std::isnan(c.z10)) {
    c.z10 = c.z00 + c.z11 - c.z01;
    return Valid::west_of_rising;
  }
  c.z01 = c.z00 + c.z11 - c.z10;
  return Valid::east_of_rising;
}

bool has_diagonal(Valid v) { return v != Valid::all && v != Valid::none; }
bool falls(Valid v) { return v == Valid::west_of_falling || v == Valid::east_of_falling; }
bool is_west(Valid v) { return v == Valid::west_of_falling || v == Valid::west_of_rising; }

/// Part of a cell between y0 and y1, in the cell's own coordinates 0..1; sides are lines.
struct Trapezoid {
  double y0, y1;
  double west0, west1, east0, east1;  // x at y0 and y1

  double west(double y) const { return mix(west0, west1, y); }
  double east(double y) const { return mix(east0, east1, y); }

 private:
  double mix(double at_0, double at_1, double y) const {
    return at_0 + (at_1 - at_0) * ((y - y0) / (y1 - y0));
  }
};

/// Gauss-Legendre on -1..1, eight places: exact to degree 15.
constexpr std::array<std::pair<double, double>, 4> kGauss = {
    {{0.1834346424956498, 0.3626837833783620},
     {0.5255324099163290, 0.3137066458778873},
     {0.7966664774136267, 0.2223810344533745},
     {0.9602898564975363, 0.1012285362903763}}};

template <class F>
void gauss(double from, double to, F&& f) {
  const double half = (to - from) / 2, middle = (from + to) / 2;
  for (const auto& [at, weight] : kGauss) {
    f(middle - half * at, half * weight);
    f(middle + half * at, half * weight);
  }
}

/// Where D + shift is zero along the line from (x0, y0) to (x1, y1): shares of it, into `ys`.
void add_roots(const Cell& cell, double shift, const Trapezoid& t, bool west,
               std::vector<double>& ys) {
  const double y[] = {t.y0, (t.y0 + t.y1) / 2, t.y1};
  double v[3];
  for (int i = 0; i < 3; ++i) v[i] = cell.at(west ? t.west(y[i]) : t.east(y[i]), y[i]) + shift;
  // A parabola in s, 0..1.
  const double a = 2 * (v[0] + v[2] - 2 * v[1]), b = 4 * v[1] - 3 * v[0] - v[2], c = v[0];
  const auto add = [&](double s) {
    if (s > 0 && s < 1) ys.push_back(t.y0 + s * (t.y1 - t.y0));
  };
  const double disc = b * b - 4 * a * c;
  if (disc < 0) return;
  const double q = -(b + std::copysign(std::sqrt(disc), b)) / 2;
  if (a != 0) add(q / a);
  if (q != 0) add(c / q);
}

/// Of D + shift along x: the integrals of its positive and of its negative part.
std::pair<double, double> halves(double at_west, double at_east, double width) {
  if (at_west >= 0 && at_east >= 0) return {(at_west + at_east) / 2 * width, 0};
  if (at_west <= 0 && at_east <= 0) return {0, -(at_west + at_east) / 2 * width};
  const double up = std::max(at_west, at_east), down = -std::min(at_west, at_east);
  const double scale = width / (2 * (up + down));
  return {up * up * scale, down * down * scale};
}

class Integrator {
 public:
  Integrator(const DemInfo& info, double uncertainty_m) : ground_(info), e_(uncertainty_m) {}

  AreaIntegral out;

  void take(const Cell& cell, const Trapezoid& t) {
    if (!(t.y1 > t.y0)) return;
    out.area_m2 += area(cell, t);
    const auto [above, below] = parts(cell, t, 0);
    out.above_m3 += above, out.below_m3 += below;
    if (e_ == 0) return;
    const auto high = parts(cell, t, e_), low = parts(cell, t, -e_);
    out.above_high_m3 += high.first, out.below_low_m3 += high.second;
    out.above_low_m3 += low.first, out.below_high_m3 += low.second;
  }
  void take_void(const Cell& cell, const Trapezoid& t) {
    if (t.y1 > t.y0) out.void_area_m2 += area(cell, t);
  }
  AreaIntegral taken() {
    if (e_ == 0) {
      out.above_low_m3 = out.above_high_m3 = out.above_m3;
      out.below_low_m3 = out.below_high_m3 = out.below_m3;
    }
    return out;
  }

 private:
  GroundArea ground_;
  double e_;
  std::vector<double> ys_;

  double area(const Cell& cell, const Trapezoid& t) const {
    double sum = 0;
    gauss(t.y0, t.y1, [&](double y, double weight) {
      const double west = t.west(y), east = t.east(y);
      sum += weight * ground_.at(cell.x + (west + east) / 2, cell.y + y) * (east - west);
    });
    return sum;
  }
  std::pair<double, double> parts(const Cell& cell, const Trapezoid& t, double shift) {
    ys_.assign({t.y0, t.y1});
    add_roots(cell, shift, t, true, ys_);
    add_roots(cell, shift, t, false, ys_);
    std::ranges::sort(ys_);
    double above = 0, below = 0;
    for (std::size_t i = 1; i < ys_.size(); ++i) {
      if (!(ys_[i] > ys_[i - 1])) continue;
      gauss(ys_[i - 1], ys_[i], [&](double y, double weight) {
        const double west = t.west(y), east = t.east(y);
        const auto [up, down] =
            halves(cell.at(west, y) + shift, cell.at(east, y) + shift, east - west);
        const double m2 = weight * ground_.at(cell.x + (west + east) / 2, cell.y + y);
        above += m2 * up, below += m2 * down;
      });
    }
    return {above, below};
  }
};

/// The part of a trapezoid that has heights, and the other.
void take_valid(Integrator& to, const Cell& cell, Valid valid, const Trapezoid& t) {
  if (valid == Valid::none) return to.take_void(cell, t);
  if (valid == Valid::all) return to.take(cell, t);
  const auto diagonal = [&](double y) { return falls(valid) ? 1 - y : y; };
  // The slab was cut where a side crosses the diagonal, so clamping keeps lines lines.
  const double d0 = std::clamp(diagonal(t.y0), t.west0, t.east0);
  const double d1 = std::clamp(diagonal(t.y1), t.west1, t.east1);
  const Trapezoid west{t.y0, t.y1, t.west0, t.west1, d0, d1};
  const Trapezoid east{t.y0, t.y1, d0, d1, t.east0, t.east1};
  to.take(cell, is_west(valid) ? west : east);
  to.take_void(cell, is_west(valid) ? east : west);
}

/// Where slabs of a cell begin and end, 0..1: where something turns.
std::vector<double> slabs(const Cell& cell, Valid valid, std::span<const RowEdge> edges,
                          std::span<const FlatEdge> flat) {
  std::vector<double> ys = {0, 1};
  const auto add = [&](double y) {
    if (y > 0 && y < 1) ys.push_back(y);
  };
  for (const RowEdge& e : edges) {
    if (e.east < cell.x || e.west > cell.x + 1) continue;
    const double rise = (e.edge->b.x - e.edge->a.x) / (e.edge->b.y - e.edge->a.y);  // x a row
    const double x0 = e.edge->x_at(cell.y) - cell.x;                                // at the top
    add(e.low_y - cell.y);
    add(e.high_y - cell.y);
    if (rise != 0) add(-x0 / rise), add((1 - x0) / rise);
    if (has_diagonal(valid) && falls(valid) && rise != -1) add((1 - x0) / (1 + rise));
    if (has_diagonal(valid) && !falls(valid) && rise != 1) add(x0 / (1 - rise));
  }
  for (const FlatEdge& e : flat)
    if (e.east >= cell.x && e.west <= cell.x + 1) add(e.y - cell.y);
  std::ranges::sort(ys);
  return ys;
}

constexpr double kHair = 1e-12;  // of a cell
/// Sides that change places by less than this, cells, lie on each other, but for rounding: they are
/// not cut at each crossing that rounding makes of that.
constexpr double kApart = 1e-9;

/// A cell that edges go through. `edges`: of its row, by low_y, so that each slab looks only at
/// those that reach it; `flat`: inside its row.
void take_rim_cell(Integrator& to, const Cell& cell, Valid valid, std::span<const RowEdge> edges,
                   std::span<const FlatEdge> flat) {
  std::vector<double> ys = slabs(cell, valid, edges, flat);  // what is left of them, the next last
  std::ranges::reverse(ys);
  struct Side {
    double middle, at_0, at_1;
    const RowEdge* crosses;  // null: it passes beside the cell
  };
  std::vector<Side> sides;
  std::vector<const RowEdge*> here;
  std::size_t next = 0;
  while (ys.size() > 1) {
    const double y0 = ys.back(), y1 = ys[ys.size() - 2], middle = (y0 + y1) / 2;
    ys.pop_back();
    if (!(y1 > y0)) continue;
    sides.clear();
    while (next < edges.size() && edges[next].low_y <= cell.y + middle)
      here.push_back(&edges[next++]);
    std::erase_if(here, [&](const RowEdge* e) { return e->high_y <= cell.y + middle; });
    for (const RowEdge* const e : here) {
      const auto in_cell = [&](double y) {
        return std::clamp(e->edge->x_at(cell.y + y) - cell.x, 0.0, 1.0);
      };
      const double x = e->edge->x_at(cell.y + middle) - cell.x;
      const bool crosses = e->east >= cell.x && e->west <= cell.x + 1 && x >= 0 && x <= 1;
      sides.push_back({x, crosses ? in_cell(y0) : in_cell(middle),
                       crosses ? in_cell(y1) : in_cell(middle), crosses ? e : nullptr});
    }
    std::ranges::sort(sides, {}, &Side::middle);
    // Where two sides cross each other, the slab ends.
    double crossing = y1;
    for (std::size_t k = 0; k + 1 < sides.size(); ++k) {
      const Side &w = sides[k], &e = sides[k + 1];
      if (!w.crosses || !e.crosses || std::max(w.at_0 - e.at_0, w.at_1 - e.at_1) < kApart) continue;
      const double before = w.crosses->edge->x_at(cell.y + y0) - e.crosses->edge->x_at(cell.y + y0),
                   after = w.crosses->edge->x_at(cell.y + y1) - e.crosses->edge->x_at(cell.y + y1);
      const double y = y0 + (y1 - y0) * (before / (before - after));
      if (y > y0 + kHair && y < y1 - kHair) crossing = std::min(crossing, y);
    }
    if (crossing < y1) {
      ys.insert(ys.end(), {crossing, y0});
      continue;
    }
    for (std::size_t k = 0; k + 1 < sides.size(); k += 2) {
      const Side &w = sides[k], &e = sides[k + 1];
      if (w.at_0 == e.at_0 && w.at_1 == e.at_1) continue;
      take_valid(to, cell, valid,
                 {y0, y1, w.at_0, w.at_1, std::max(e.at_0, w.at_0), std::max(e.at_1, w.at_1)});
    }
  }
}

/// A row of cells.
class RowOfCells {
 public:
  RowOfCells(std::int64_t row, std::span<const Edge* const> active, std::span<const FlatEdge> flat,
             std::int64_t cols)
      : row_(row), flat_(flat), touched_(std::size_t(std::max<std::int64_t>(cols - 1, 0)), false) {
    const double last = double(cols) - 2;
    const auto touch = [&](double west, double east) {
      // Whole numbers, which a double counts without rounding.
      // NOLINTNEXTLINE(clang-analyzer-security.FloatLoopCounter)
      for (double c = std::max(0.0, std::floor(west)); c <= std::min(last, std::floor(east)); ++c)
        touched_[std::size_t(c)] = true;
    };
    for (const FlatEdge& e : flat) touch(e.west, e.east);
    for (const Edge* e : active) {
      RowEdge r{e, std::max(e->a.y, double(row)), std::min(e->b.y, double(row + 1)), 0, 0};
      if (!(r.high_y > r.low_y)) continue;
      const double p = e->x_at(r.low_y), q = e->x_at(r.high_y);
      r.west = std::min(p, q), r.east = std::max(p, q);
      edges_.push_back(r);
      touch(r.west, r.east);
      if (e->a.y <= middle() && middle() < e->b.y) crossings_.push_back(e->x_at(middle()));
    }
    std::ranges::sort(crossings_);
    std::ranges::sort(edges_, {}, &RowEdge::low_y);
  }

  void take(std::span<const double> north, std::span<const double> south, Integrator& to) const {
    for (std::size_t c = 0; c < touched_.size(); ++c) {
      const bool inside =
          (std::ranges::lower_bound(crossings_, double(c) + 0.5) - crossings_.begin()) % 2 == 1;
      if (!touched_[c] && !inside) continue;
      Cell cell{north[c], north[c + 1], south[c], south[c + 1], double(c), double(row_)};
      const Valid valid = complete(cell);
      if (touched_[c])
        take_rim_cell(to, cell, valid, edges_, flat_);
      else
        take_valid(to, cell, valid, {0, 1, 0, 0, 1, 1});
    }
  }
  bool empty() const { return edges_.empty(); }

 private:
  std::int64_t row_;
  std::span<const FlatEdge> flat_;
  std::vector<RowEdge> edges_;
  std::vector<char> touched_;
  std::vector<double> crossings_;  // in the middle of the row, from the west

  double middle() const { return double(row_) + 0.5; }
};

}  // namespace

PostRings whole_area(const DemInfo& info) {
  const double east = double(info.cols - 1), south = double(info.rows - 1);
  return {{{0, 0}, {east, 0}, {east, south}, {0, south}}};
}

GroundArea::GroundArea(const DemInfo& info) : map_(info.post_to_crs) {
  unit_m_ = info.crs_unit_m;
  if (info.crs_kind != CrsKind::geographic) return;
  const double step = std::hypot(map_.x_col, map_.y_col);
  degrees_ = info.period_cols > 0 && step > 0 ? 360 / (info.period_cols * step) : 1;
}

double GroundArea::at(double col, double row) const {
  const double units = std::abs(map_.x_col * map_.y_row - map_.x_row * map_.y_col);
  if (degrees_ == 0) return units * unit_m_ * unit_m_;
  const double lat = map_.apply(col, row).y * degrees_;
  const Vec2 metres = wgs84::metres_per_degree(std::clamp(lat, -90.0, 90.0));
  return units * degrees_ * degrees_ * metres.x * metres.y;
}

Result<AreaIntegral> integrate(const DemInfo& info, const PostRings& area, const PostRow& rows,
                               double uncertainty_m, const Progress& progress) {
  const Edges edges = edges_of(area);
  const std::vector<Edge>& sides = edges.sides;
  Integrator integrator(info, uncertainty_m);
  std::vector<const Edge*> active;
  std::size_t next = 0;
  std::vector<double> north(std::size_t(info.cols)), south(std::size_t(info.cols));
  std::int64_t read = -1;  // the row that `south` has
  for (std::int64_t r = 0; r + 1 < info.rows; ++r) {
    while (next < sides.size() && sides[next].a.y < double(r + 1)) active.push_back(&sides[next++]);
    std::erase_if(active, [&](const Edge* e) { return e->b.y <= double(r); });
    const auto flat = std::ranges::subrange(
        std::ranges::upper_bound(edges.flat, double(r), {}, &FlatEdge::y),
        std::ranges::lower_bound(edges.flat, double(r + 1), {}, &FlatEdge::y));
    const RowOfCells cells(r, active, flat, info.cols);
    if (cells.empty()) continue;
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    if (read == r)
      std::swap(north, south);
    else if (auto ok = rows(r, north); !ok)
      return std::unexpected(ok.error());
    if (auto ok = rows(r + 1, south); !ok) return std::unexpected(ok.error());
    read = r + 1;
    cells.take(north, south, integrator);
    if (r % 64 == 0) progress.at(double(r) / double(info.rows));
  }
  return integrator.taken();
}

bool reaches_beyond(const DemInfo& info, const PostRings& area) {
  constexpr double kSnap = 1e-6;  // posts
  for (const auto& ring : area)
    for (const Vec2& p : ring)
      if (!(p.x >= -kSnap && p.y >= -kSnap && p.x <= double(info.cols - 1) + kSnap &&
            p.y <= double(info.rows - 1) + kSnap))
        return true;
  return false;
}

}  // namespace tind
