// The lattice of a layer goes on beyond its posts. Of its places in the tile those count where a
// lower layer decides: there H is that layer, bent.

#include "terrain/surface/rim_samples.h"

#include <algorithm>
#include <cmath>

#include "terrain/base/power_of_two.h"
#include "terrain/surface/post_warp.h"
#include "terrain/surface/surface.h"

namespace tind {

namespace {

constexpr int kAcrossBlend = 16, kAcrossTile = 256;  // samples

std::int64_t step_of(const SurfaceLayer& layer, double tile_degrees) {
  const double tile_m = tile_degrees * 111320;
  const double posts =
      std::max(layer.blend_m / kAcrossBlend, tile_m / kAcrossTile) / layer.finest_m();
  return std::int64_t(power_of_two_at_most(std::max(1.0, posts)));
}

/// Multiples of a step, in posts.
struct Lattice {
  std::int64_t col = 0, row = 0;
  int cols = 0, rows = 0;
};

/// All that can lie in the rectangle, no farther from the layer's posts than it bends.
Lattice lattice_over(const SurfaceLayer& layer, const GeoRect& r, std::int64_t step) {
  constexpr int kSide = 9;
  const DemInfo& info = layer.source->info();
  std::vector<Geographic> places;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      places.push_back({r.west + r.width() * i / (kSide - 1),
                        std::min(90.0, r.south + r.height() * j / (kSide - 1))});
  std::vector<Vec2> posts(places.size());
  layer.source->to_post(places, posts);
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  const bool small = r.height() < 6;  // projections bend too much between places of larger tiles
  const bool straight = layer.source->is_plain_geographic() && info.post_to_crs.x_col > 0;
  bool known = small || straight;
  for (const Vec2& p : posts) {
    known = known && std::isfinite(p.x) && std::isfinite(p.y);
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  bool around = false;                // from there on, beyond the last column, too
  if (straight && !small && known) {  // longitudes may jump from one place to the next
    const double cols = r.width() / 360 * info.period_cols;
    around = info.wraps_longitude && std::fmod(info.period_cols, double(step)) == 0;
    low.x = posts.front().x, high.x = low.x + cols;
    if (!info.wraps_longitude) {  // the turn that lies nearest
      const double off = double(info.cols - 1) / 2 - (low.x + high.x) / 2;
      const double turn = std::round(off / info.period_cols) * info.period_cols;
      low.x += turn, high.x += turn;
    }
    if (info.wraps_longitude ? !around : double(info.cols) + cols > info.period_cols)
      low.x = 0, high.x = double(info.cols - 1);
  }
  const double bend = known ? 0.01 * std::max(high.x - low.x, high.y - low.y) + 1 : HUGE_VAL;
  const auto range = [&](double from, double to, double reach, std::int64_t count,
                         std::int64_t& first, int& n) {
    const double begin = std::max(from - bend, -reach),
                 end = std::min(to + bend, count - 1 + reach);
    first = std::int64_t(std::ceil(begin / double(step))) * step;
    n = int(std::max(0.0, std::floor((end - double(first)) / double(step)) + 1));
  };
  Lattice lattice;
  const double reach_x = around                 ? info.period_cols
                         : info.wraps_longitude ? 0
                                                : std::ceil(layer.blend_m / layer.spacing_m.x);
  range(low.x, high.x, reach_x, info.cols, lattice.col, lattice.cols);
  range(low.y, high.y, std::ceil(layer.blend_m / layer.spacing_m.y), info.rows, lattice.row,
        lattice.rows);
  return lattice;
}

/// Of layer k.
Result<void> add_samples(const HeightField& field, std::size_t k, const GeoRect& rect,
                         double of_degrees, std::vector<Vec3>& samples) {
  const Surface& surface = field.surface();
  const SurfaceLayer& layer = surface.layers()[k];
  const auto step = int(step_of(layer, of_degrees));
  const Lattice l = lattice_over(layer, rect, step);
  if (l.cols <= 0 || l.rows <= 0) return {};
  const auto own = layer.source->read_decimated(l.col, l.row, l.cols, l.rows, step);
  if (!own) return std::unexpected(own.error());
  const auto lattice = post_positions(*layer.source, l.col, l.row, l.cols, l.rows, step);
  std::vector<Geographic> places;
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const Geographic& p = lattice[i];
    if (!std::isnan(own->values()[i]) || !surface.reaches(k, {p.lon, p.lat, p.lon, p.lat}))
      continue;
    const double lon = p.lon - 360 * std::round((p.lon - (rect.west + rect.east) / 2) / 360);
    const double u = (lon - rect.west) / rect.width() * kTileExtent,
                 v = (p.lat - rect.south) / rect.height() * kTileExtent;
    if (!(u >= 0 && v >= 0 && u <= kTileExtent && v <= kTileExtent)) continue;
    places.push_back(p);
    points.push_back({u, v, 0});
  }
  std::vector<double> heights(places.size());
  std::vector<int> deciding(places.size());
  field.at(places, heights, deciding);
  if (const auto error = field.error()) return std::unexpected(*error);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (deciding[i] >= 0 && deciding[i] < int(k) && !std::isnan(heights[i]))
      samples.push_back({points[i].x, points[i].y, heights[i]});
  return {};
}

}  // namespace

Result<std::vector<Vec3>> rim_samples(const HeightField& field, const GeoRect& rect,
                                      double of_degrees) {
  std::vector<Vec3> samples;
  const Surface& surface = field.surface();
  for (std::size_t k = 1; k < surface.layers().size(); ++k) {
    if (!(surface.layers()[k].blend_m > 0) || !surface.reaches(k, rect)) continue;
    if (auto done = add_samples(field, k, rect, of_degrees, samples); !done)
      return std::unexpected(done.error());
  }
  return samples;
}

}  // namespace tind
