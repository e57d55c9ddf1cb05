#pragma once
// A straight way over a DEM's surface, piece by piece: between two lines of its grid the surface
// along the way is a parabola, so that whoever asks for its top, or for where another parabola
// comes nearest to it, solves one equation in place of taking samples.
//
// Why a parabola: inside a cell of four posts H is z00 + A x + B y + C x y. Along x = x0 + dx t,
// y = y0 + dy t that is of second degree in t. Over three posts (one is void) H is a plane, on one
// side of the cell's diagonal (raster/interpolate.h), so such a cell has two pieces.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "terrain/geo/coordinates.h"

namespace tind {

/// a + b t + c t^2.
struct Parabola {
  double a = 0, b = 0, c = 0;

  double at(double t) const { return a + t * (b + t * c); }
  /// Where in [from, to] it first is below zero. REQUIRES: it is at `to`.
  double first_below_in(double from, double to) const {
    if (at(from) < 0) return from;
    // Of both roots, each without a difference of near numbers, the first one inside.
    const double disc = std::max(0.0, b * b - 4 * a * c);
    const double q = -(b + std::copysign(std::sqrt(disc), b)) / 2;
    double first = to;
    for (const double t : {q / c, a / q})
      if (t >= from && t < first) first = t;
    return first;
  }
  friend Parabola operator-(const Parabola& p, const Parabola& q) {
    return {p.a - q.a, p.b - q.b, p.c - q.c};
  }
  /// Where in [from, to] it is lowest; of several places the first.
  double lowest_in(double from, double to) const {
    double best = at(to) < at(from) ? to : from;
    if (const double t = -b / (2 * c); c > 0 && t > from && t < to && at(t) < at(best)) best = t;
    return best;
  }
};

/// Through values at t = 0, 1/2 and 1.
inline Parabola parabola_through(double at_0, double at_half, double at_1) {
  return {at_0, 4 * at_half - 3 * at_0 - at_1, 2 * (at_0 + at_1) - 4 * at_half};
}

/// H along a part of a straight way.
struct WalkPiece {
  double from = 0, to = 0;  // t of the way, 0..1; from < to
  Parabola height;          // REQUIRES: not void
  bool is_void = false;
  /// H changes by no more than this a post, in any direction, in the cell.
  double steepest = 0;
};

namespace walk {

/// Four posts around a piece, and the way among them: (x, y) + t (dx, dy) from the first post.
struct CellWay {
  double z00, z10, z01, z11;
  double x, y, dx, dy;

  int voids() const {
    return std::isnan(z00) + std::isnan(z10) + std::isnan(z01) + std::isnan(z11);
  }
  WalkPiece piece(double from, double to) const {
    const double a = z10 - z00, b = z01 - z00, c = z11 - z10 - z01 + z00;
    WalkPiece out{from, to, {}, false, 0};
    out.height = {z00 + a * x + b * y + c * x * y, a * dx + b * dy + c * (x * dy + y * dx),
                  c * dx * dy};
    out.steepest =
        std::hypot(std::max(std::abs(a), std::abs(a + c)), std::max(std::abs(b), std::abs(b + c)));
    return out;
  }
  /// With one void: `inside`(t) > 0 where the triangle of the others is.
  Parabola inside() const {
    if (std::isnan(z00)) return {x + y - 1, dx + dy, 0};
    if (std::isnan(z11)) return {1 - x - y, -dx - dy, 0};
    if (std::isnan(z10)) return {y - x, dy - dx, 0};
    return {x - y, dx - dy, 0};
  }
  /// The one that is void put on the plane of the others.
  CellWay completed() const {
    CellWay cell = *this;
    if (std::isnan(z00)) cell.z00 = z10 + z01 - z11;
    if (std::isnan(z11)) cell.z11 = z10 + z01 - z00;
    if (std::isnan(z10)) cell.z10 = z00 + z11 - z01;
    if (std::isnan(z01)) cell.z01 = z00 + z11 - z10;
    return cell;
  }
};

/// The pieces of one cell. False: `take` wants no more.
template <class Take>
bool take_cell(const CellWay& cell, double from, double to, Take&& take) {
  const int voids = cell.voids();
  if (voids == 0) return take(cell.piece(from, to));
  if (voids > 1) return take(WalkPiece{from, to, {}, true, 0});
  const Parabola inside = cell.inside();
  const CellWay whole = cell.completed();
  const auto part = [&](double a, double b) {
    const double middle = inside.at((a + b) / 2);
    return take(middle >= 0 ? whole.piece(a, b) : WalkPiece{a, b, {}, true, 0});
  };
  const double turn = inside.b == 0 ? from : -inside.a / inside.b;
  if (!(turn > from && turn < to)) return part(from, to);
  return part(from, turn) && part(turn, to);
}

}  // namespace walk

/// Goes from p to q in post coordinates. `post(col, row)`: a height, NaN for a void and beyond the
/// DEM. `take(WalkPiece)` is given every piece in its order, and says whether to go on. Posts of
/// zero weight do not matter, as in height_between(). O(cells).
template <class Post, class Take>
bool walk_grid(Vec2 p, Vec2 q, Post&& post, Take&& take) {
  const double dx = q.x - p.x, dy = q.y - p.y;
  const auto next = [](double from, double d) {  // the first line of the grid beyond
    return d > 0 ? std::floor(from) + 1 : std::ceil(from) - 1;
  };
  const double never = std::numeric_limits<double>::infinity();
  double col = next(p.x, dx), row = next(p.y, dy);
  double t = 0;
  while (t < 1) {
    const double at_col = dx == 0 ? never : (col - p.x) / dx;
    const double at_row = dy == 0 ? never : (row - p.y) / dy;
    const double to = std::min({at_col, at_row, 1.0});
    if (at_col <= to) col += dx > 0 ? 1 : -1;
    if (at_row <= to) row += dy > 0 ? 1 : -1;
    if (!(to > t)) continue;
    const double middle = (t + to) / 2;
    const double c = std::floor(p.x + dx * middle), r = std::floor(p.y + dy * middle);
    const auto ci = std::int64_t(c), ri = std::int64_t(r);
    const bool on_col = dx == 0 && p.x == c, on_row = dy == 0 && p.y == r;
    walk::CellWay cell{post(ci, ri), 0, 0, 0, p.x - c, p.y - r, dx, dy};
    cell.z10 = on_col ? cell.z00 : post(ci + 1, ri);
    cell.z01 = on_row ? cell.z00 : post(ci, ri + 1);
    cell.z11 = on_col ? cell.z01 : on_row ? cell.z10 : post(ci + 1, ri + 1);
    if (!walk::take_cell(cell, t, to, take)) return false;
    t = to;
  }
  return true;
}

}  // namespace tind
