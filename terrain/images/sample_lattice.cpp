// Rows of pixels are taken in bands whose posts fit into memory.

#include "terrain/images/sample_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/surface/void_fill.h"

namespace tind {
namespace {

constexpr int kMostSamples = 8;                             // of H a pixel, along each axis
constexpr std::int64_t kImageBand = std::int64_t(1) << 23;  // posts of a layer at a time

/// Ground length of a pixel, metres, in the tile's middle.
double pixel_m(web_mercator::Tile tile, int pixels) {
  const GeoRect r = web_mercator::rect(tile);
  const double lat = (r.south + r.north) / 2 * (std::numbers::pi / 180);
  return web_mercator::kEarthM * std::cos(lat) / std::ldexp(1.0, tile.level) / pixels;
}

int samples_of(const Surface& surface, web_mercator::Tile tile, int pixels) {
  const GeoRect rect = web_mercator::rect(tile);
  double finest = HUGE_VAL;
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    const DemInfo& info = surface.layers()[k].source->info();
    if (surface.reaches(k, rect)) finest = std::min({finest, info.spacing_x_m, info.spacing_y_m});
  }
  // A hundredth more is not worth four samples.
  const double dense = std::ceil(pixel_m(tile, pixels) / finest - .01);
  return int(std::clamp(dense, 1.0, double(kMostSamples)));
}

/// f(layer, window) of each layer that has posts in the rectangle.
template <class F>
void each_window(const Surface& surface, const GeoRect& rect, F&& f) {
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    if (!surface.reaches(k, rect)) continue;
    for (const PostWindow& w : post_windows(*surface.layers()[k].source, rect)) f(k, w);
  }
}

/// Of the layer that has most.
std::int64_t posts_in(const Surface& surface, const GeoRect& rect) {
  std::int64_t most = 0;
  each_window(surface, rect,
              [&](std::size_t, const PostWindow& w) { most = std::max(most, w.cols * w.rows); });
  return most;
}

/// More rectangles than that are looked at as one, each layer's bounds.
constexpr std::size_t kMostExtents = 64;

/// Where H can be that posts up to `posts` away say, and some more: posts reach half a spacing, but
/// are wider in one part of a projection than in its middle.
std::vector<GeoRect> near_extents(const Surface& surface, int posts) {
  constexpr double kDegree_m = 111320, kShare = 1. / 8, kWider = 4;
  const SurfaceShapes* shapes = surface.shapes();
  const double most_lat = web_mercator::rect({0, 0, 0}).north;
  if (shapes && !shapes->level_areas().empty()) return {{-540, -90, 540, 90}};  // they go beyond it
  std::vector<GeoRect> all;
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    const bool whole = info.extents.empty() || info.extents.size() > kMostExtents;
    for (GeoRect r : whole ? std::vector{info.bounds} : info.extents) {
      const double lat = std::min(most_lat, std::max(std::abs(r.south), std::abs(r.north)));
      const double up = kWider * posts * layer.coarsest_m() / kDegree_m;
      const double y = up + kShare * r.height();
      const double x = up / std::cos(std::min(most_lat, lat + y) * (std::numbers::pi / 180)) +
                       kShare * r.width();
      all.push_back({r.west - x, r.south - y, r.east + x, r.north + y});
    }
  }
  return all;
}

}  // namespace

SampleLattice::SampleLattice(const Surface& surface, web_mercator::Tile tile, int pixels)
    : field_(surface),
      pixels_(pixels),
      samples_(samples_of(surface, tile, pixels)),
      tile_(tile),
      tile_side_(1 / std::ldexp(1.0, tile.level)),
      near_(near_extents(surface, 2)),
      fillable_(near_extents(surface, VoidFill::kReach + 2)) {}

double SampleLattice::lon_of(double col) const {
  const double u = tile_.x * tile_side_ + tile_side_ * (col + .5) / side();
  return web_mercator::lon_of(u < 0 ? u + 1 : u > 1 ? u - 1 : u);
}

double SampleLattice::lat_of(double row) const {
  return web_mercator::lat_of(tile_.y * tile_side_ + tile_side_ * (row + .5) / side());
}

Geographic SampleLattice::centre_of(int pixel_col, int pixel_row) const {
  return {lon_of((pixel_col + .5) * samples_ - .5), lat_of((pixel_row + .5) * samples_ - .5)};
}

void SampleLattice::heights(int row, int begin, std::span<double> heights) {
  const double lat = lat_of(row);
  const int end = begin + int(heights.size());
  find_spans(lat, begin, end);
  std::ranges::fill(heights, std::numeric_limits<double>::quiet_NaN());
  for (const auto& [first, last] : spans_) {
    places_.clear();
    for (int col = first; col < last; ++col) places_.push_back({lon_of(col), lat});
    field_.at(places_, heights.subspan(std::size_t(first - begin), places_.size()));
  }
}

/// Columns [first, second) of [begin, end) that lie near the surface on that parallel, apart from
/// each other.
void SampleLattice::find_spans(double lat, int begin, int end) {
  spans_.clear();
  const auto col_of = [&](double lon) {
    return (web_mercator::u_of(lon) - tile_.x * tile_side_) / tile_side_ * side() - .5;
  };
  for (const GeoRect& r : near_)
    if (lat >= r.south && lat <= r.north)
      for (const double turn : {-360., 0., 360.}) {
        const double first = std::floor(std::max(col_of(r.west + turn), double(begin)));
        const double last = std::ceil(std::min(col_of(r.east + turn) + 1, double(end)));
        if (first < last) spans_.emplace_back(std::max(int(first), begin), int(last));
      }
  std::ranges::sort(spans_);
  std::size_t kept = 0;
  for (const auto& span : spans_)
    if (kept > 0 && span.first <= spans_[kept - 1].second)
      spans_[kept - 1].second = std::max(spans_[kept - 1].second, span.second);
    else
      spans_[kept++] = span;
  spans_.resize(kept);
}

bool SampleLattice::may_fill(Geographic p) const {
  return std::ranges::any_of(fillable_, [&](const GeoRect& r) {
    return r.contains(p) || r.contains({p.lon - 360, p.lat}) || r.contains({p.lon + 360, p.lat});
  });
}

/// Beyond the antimeridian the map goes on at its other end: what is needed from there is read when
/// it is asked for.
Result<void> SampleLattice::load(int first_row, int end_row, int margin) {
  const GeoRect tile = web_mercator::rect(tile_);
  const double wide = (tile.east - tile.west) * margin / side();
  const GeoRect rect = {std::max(-180., tile.west - wide), lat_of(end_row * samples_ - .5 + margin),
                        std::min(180., tile.east + wide),
                        lat_of(first_row * samples_ - .5 - margin)};
  Result<void> done;
  each_window(field_.surface(), rect, [&](std::size_t k, const PostWindow& w) {
    if (done) done = field_.load(k, w.col - 1, w.row - 1, int(w.cols) + 2, int(w.rows) + 2);
  });
  return done;
}

Result<void> SampleLattice::each_pixel_row(int margin, const std::stop_token& stop,
                                           const std::function<void(int)>& f) {
  const std::int64_t posts = posts_in(field_.surface(), web_mercator::rect(tile_));
  const int bands = int(std::clamp<std::int64_t>(posts / kImageBand + 1, 1, pixels_));
  for (int band = 0; band < bands; ++band) {
    const int begin = band * pixels_ / bands, end = (band + 1) * pixels_ / bands;
    if (auto done = load(begin, end, margin); !done) return done;
    for (int row = begin; row < end; ++row) {
      if (stop.stop_requested())
        return fail(Errc::cancelled, "nobody waits for the image any more");
      f(row);
    }
    if (const auto error = field_.error()) return std::unexpected(*error);
  }
  return {};
}

}  // namespace tind
