// What lies under a piece is found by its rim, which is followed post by post: a piece across the
// antimeridian has the few columns on both sides of it, not all those between.

#include "terrain/heightmaps/lattice_pieces.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "terrain/geo/longitude.h"

namespace tind {
namespace {

constexpr int kMargin = 3;        // posts around the rim's, for H between them
constexpr double kInside = 1e-6;  // of a cell: a pole is on earth, a rounding beyond it is not
constexpr int kFewCols = 4;  // whose middles are asked, too: their edges may be half a globe apart

/// Places around a piece, in their order.
struct Rim {
  std::vector<Geographic> places;
  bool whole = true;  // all of them are on earth, and they go around no pole
  GeoRect rect{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
};

bool on_earth(const Geographic& p) { return std::isfinite(p.lon) && std::isfinite(p.lat); }

std::vector<Geographic> walk_around(const RasterLattice& lattice, const LatticePiece& piece) {
  std::vector<Geographic> walk;
  const auto add = [&](double row, double first, int count) {
    const std::size_t at = walk.size();
    walk.resize(at + std::size_t(count));
    lattice.places(row, first, std::span(walk).subspan(at));
  };
  const double west = piece.col - .5 + kInside, east = piece.col + piece.cols - .5 - kInside;
  const double north = piece.row - .5 + kInside, south = piece.row + piece.rows - .5 - kInside;
  const auto line = [&](double row) {
    if (piece.cols > kFewCols) return add(row, west, piece.cols), add(row, east, 1);
    for (int half = 0; half <= 2 * piece.cols; ++half)
      add(row, std::clamp(piece.col - .5 + half * .5, west, east), 1);
  };
  const auto side = [&](double col) {
    for (int row = 0; row < piece.rows; ++row) add(piece.row + row, col, 1);
  };
  const auto back = [&](const auto& go, double where) {
    const auto at = std::ptrdiff_t(walk.size());
    go(where);
    std::reverse(walk.begin() + at, walk.end());
  };
  line(north);
  side(east);
  back(line, south);
  back(side, west);
  for (Geographic& p : walk) p = within_first_turn(p);
  return walk;
}

void grow(GeoRect& rect, const Geographic& p) {
  rect = {std::min(rect.west, p.lon), std::min(rect.south, p.lat), std::max(rect.east, p.lon),
          std::max(rect.north, p.lat)};
}

/// A rim beyond the earth may have a part of it inside.
void grow_by_inside(GeoRect& rect, const RasterLattice& lattice, const LatticePiece& piece) {
  constexpr int kSide = 9;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      Geographic p;
      lattice.places(piece.row + (piece.rows - 1) * (j / (kSide - 1.)),
                     piece.col + (piece.cols - 1) * (i / (kSide - 1.)), {&p, 1});
      if (on_earth(p)) grow(rect, within_first_turn(p));
    }
}

Rim rim_of(const RasterLattice& lattice, const LatticePiece& piece) {
  constexpr double kHalfTurn = 180 - 1e-6;
  Rim rim;
  for (const Geographic& p : walk_around(lattice, piece)) {
    if (!on_earth(p)) {
      rim.whole = false;
      continue;
    }
    rim.places.push_back(p);
    grow(rim.rect, p);
  }
  if (!rim.whole) grow_by_inside(rim.rect, lattice, piece);
  double turned = 0;
  bool crosses = false;  // the antimeridian
  for (std::size_t i = 0; i < rim.places.size(); ++i) {
    const double step = rim.places[(i + 1) % rim.places.size()].lon - rim.places[i].lon;
    turned += std::remainder(step, 360);
    crosses = crosses || std::abs(step) >= kHalfTurn;
  }
  if (crosses) rim.rect.west = -180, rim.rect.east = 180;
  if (std::abs(turned) > kHalfTurn) rim.whole = false, rim.rect = {-180, -90, 180, 90};
  return rim;
}

bool touches(const GeoRect& a, const GeoRect& b) {
  return a.west <= b.east && b.west <= a.east && a.south <= b.north && b.south <= a.north;
}

/// First and number of the posts between two places of an axis that has `count` of them.
std::pair<std::int64_t, std::int64_t> posts_between(double low, double high, std::int64_t count) {
  const double first = std::max(std::floor(low) - kMargin, -1.0);
  const double last = std::min(std::ceil(high) + kMargin, double(count));
  if (!(first <= last)) return {0, 0};
  return {std::int64_t(first), std::int64_t(last - first) + 1};
}

/// Of a layer that goes around the globe.
std::pair<std::int64_t, std::int64_t> columns_around(double low, double high, double period) {
  const double first = std::floor(low) - kMargin;
  const double count = std::min(std::ceil(high) + kMargin - first, period) + 1;
  return {std::int64_t(first - period * std::floor(first / period)), std::int64_t(count)};
}

LayerPosts window_under(const DemSource& source, const Rim& rim) {
  const DemInfo& info = source.info();
  const LayerPosts all{0, -1, -1, info.cols + 2, info.rows + 2};
  if (!rim.whole) return all;
  std::vector<Vec2> posts(rim.places.size());
  source.to_post(rim.places, posts);
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  const double period = info.period_cols;
  double last = posts.front().x;
  for (Vec2 p : posts) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return all;
    if (period > 0) last = p.x = nearest_turn(p.x, last, period);
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  LayerPosts found;
  std::tie(found.row, found.rows) = posts_between(low.y, high.y, info.rows);
  if (info.wraps_longitude) {
    std::tie(found.col, found.cols) = columns_around(low.x, high.x, period);
    return found;
  }
  for (const double turn : {0.0, period, -period})
    if (const auto [col, cols] = posts_between(low.x + turn, high.x + turn, info.cols);
        cols > found.cols)
      found.col = col, found.cols = cols;
  return found;
}

std::pair<LatticePiece, LatticePiece> halves(const LatticePiece& piece, bool across) {
  LatticePiece first = piece, second = piece;
  if (across) {
    first.cols = piece.cols / 2, second.cols = piece.cols - first.cols;
    second.col += first.cols;
  } else {
    first.rows = piece.rows / 2, second.rows = piece.rows - first.rows;
    second.row += first.rows;
  }
  return {first, second};
}

}  // namespace

std::vector<LayerPosts> posts_under(const Surface& surface, const RasterLattice& lattice,
                                    const LatticePiece& piece) {
  const Rim rim = rim_of(lattice, piece);
  std::vector<LayerPosts> under;
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    const DemSource& source = *surface.layers()[k].source;
    if (!touches(rim.rect, source.info().bounds)) continue;
    LayerPosts posts = window_under(source, rim);
    posts.layer = k;
    if (posts.count() > 0) under.push_back(posts);
  }
  return under;
}

Result<void> cut_piece(const Surface& surface, const RasterLattice& lattice,
                       const LatticePiece& piece, const PieceLimits& limits,
                       const TakePiece& take) {
  const std::vector<LayerPosts> under = posts_under(surface, lattice, piece);
  std::int64_t posts = 0;
  for (const LayerPosts& of_layer : under) posts += of_layer.count();
  const bool wide = piece.cols > limits.cols, single = piece.cols == 1 && piece.rows == 1;
  if (single || (posts <= limits.posts && !wide)) return take(piece, under);
  const bool longer = piece.cols * lattice.spacing_m.x >= piece.rows * lattice.spacing_m.y;
  const bool across = piece.cols > 1 && (wide || longer || piece.rows == 1);
  const auto [first, second] = halves(piece, across);
  if (auto done = cut_piece(surface, lattice, first, limits, take); !done) return done;
  return cut_piece(surface, lattice, second, limits, take);
}

}  // namespace tind
