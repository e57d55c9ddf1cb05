// Rows of pixels are taken in bands whose posts fit into memory. Clients blend between the pixels
// of two tiles, so a pixel must not depend on its tile: the places at which H is asked are those of
// one lattice over the whole map.

#include "terrain/images/height_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrain/surface/height_field.h"
#include "terrain/surface/tile_posts.h"

namespace tind {
namespace {

constexpr int kMostSamples = 8;                             // of H a pixel, along each axis
constexpr std::int64_t kImageBand = std::int64_t(1) << 23;  // posts of a layer at a time
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Ground length of a pixel, metres, in the tile's middle.
double pixel_m(web_mercator::Tile tile, int pixels) {
  const GeoRect r = web_mercator::rect(tile);
  const double lat = (r.south + r.north) / 2 * (std::numbers::pi / 180);
  return web_mercator::kEarthM * std::cos(lat) / std::ldexp(1.0, tile.level) / pixels;
}

double spacing_m(const DemInfo& info) { return std::min(info.spacing_x_m, info.spacing_y_m); }

int samples_of(const Surface& surface, web_mercator::Tile tile, int pixels) {
  const GeoRect rect = web_mercator::rect(tile);
  double finest = HUGE_VAL;
  for (std::size_t k = 0; k < surface.layers().size(); ++k)
    if (surface.reaches(k, rect))
      finest = std::min(finest, spacing_m(surface.layers()[k].source->info()));
  // A hundredth more is not worth four samples.
  const double dense = std::ceil(pixel_m(tile, pixels) / finest - .01);
  return int(std::clamp(dense, 1.0, double(kMostSamples)));
}

/// One row of the image at a time: where H is asked, and what becomes of the answers.
class ImageRows {
 public:
  ImageRows(web_mercator::Tile tile, HeightImage& image)
      : image_(image), side_(1 / std::ldexp(1.0, tile.level)), u0_(tile.x * side_), tile_(tile) {
    const std::size_t places = std::size_t(image.pixels) * image.samples * image.samples;
    places_.resize(places);
    heights_.resize(places);
  }

  void fill_in(const HeightField& field, int row) {
    const int n = image_.samples, wide = image_.pixels * n;
    for (int j = 0; j < n; ++j) {
      const double lat = lat_at(row * n + j, n);
      for (int i = 0; i < wide; ++i)
        places_[std::size_t(j) * wide + i] = {web_mercator::lon_of(u0_ + side_ * (i + .5) / wide),
                                              lat};
    }
    field.at(places_, heights_);
    float* const out = &image_.heights[std::size_t(row) * image_.pixels];
    empty_.clear();
    for (int x = 0; x < image_.pixels; ++x) {
      const double mean = mean_of(x);
      if (std::isnan(mean)) {
        empty_.push_back(x);
        continue;
      }
      out[x] = float(mean);
      note_deviation(x, mean);
    }
    fill_empty(field, row, out);
  }

 private:
  double lat_at(int sample_row, int n) const {
    return web_mercator::lat_of(tile_.y * side_ +
                                side_ * (sample_row + .5) / (double(image_.pixels) * n));
  }

  template <class F>
  void each_sample(int x, const F& f) const {
    const int n = image_.samples, wide = image_.pixels * n;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double h = heights_[std::size_t(j) * wide + std::size_t(x) * n + i];
        if (!std::isnan(h)) f(h);
      }
  }

  double mean_of(int x) const {
    double sum = 0;
    int count = 0;
    each_sample(x, [&](double h) { sum += h, ++count; });
    return count > 0 ? sum / count : kNaN;
  }

  void note_deviation(int x, double mean) {
    each_sample(x, [&](double h) {
      image_.max_deviation_m = std::max(image_.max_deviation_m, std::abs(h - mean));
    });
  }

  void fill_empty(const HeightField& field, int row, float* out) {
    if (empty_.empty()) return;
    std::vector<Geographic> centres;
    for (const int x : empty_)
      centres.push_back(
          {web_mercator::lon_of(u0_ + side_ * (x + .5) / image_.pixels), lat_at(row, 1)});
    std::vector<double> filled(centres.size());
    field.filled(centres, filled);
    for (std::size_t k = 0; k < empty_.size(); ++k)
      out[empty_[k]] = std::isnan(filled[k]) ? 0.f : float(filled[k]);
    filled_ += empty_.size();
    image_.filled_share = double(filled_) / double(image_.heights.size());
  }

  HeightImage& image_;
  const double side_, u0_;
  const web_mercator::Tile tile_;
  std::vector<Geographic> places_;
  std::vector<double> heights_;
  std::vector<int> empty_;
  std::size_t filled_ = 0;
};

/// f(layer, window) of each layer that has posts in the rectangle.
template <class F>
void each_window(const Surface& surface, const GeoRect& rect, F&& f) {
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    if (!surface.reaches(k, rect)) continue;
    const PostWindow w = post_window(*surface.layers()[k].source, rect);
    if (!w.empty()) f(k, w);
  }
}

/// The posts that rows of pixels can need, into memory.
Result<void> load(HeightField& field, const GeoRect& rect) {
  Result<void> done;
  each_window(field.surface(), rect, [&](std::size_t k, const PostWindow& w) {
    if (done) done = field.load(k, w.col - 1, w.row - 1, int(w.cols) + 2, int(w.rows) + 2);
  });
  return done;
}

/// Of the layer that has most.
std::int64_t posts_in(const Surface& surface, const GeoRect& rect) {
  std::int64_t most = 0;
  each_window(surface, rect,
              [&](std::size_t, const PostWindow& w) { most = std::max(most, w.cols * w.rows); });
  return most;
}

}  // namespace

int deepest_image_level(const Surface& surface) {
  double finest = HUGE_VAL;
  double lat = 0;
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    if (spacing_m(info) >= finest) continue;
    finest = spacing_m(info);
    lat = (info.bounds.south + info.bounds.north) / 2 * (std::numbers::pi / 180);
  }
  const double root = web_mercator::kEarthM * std::cos(lat) / kImagePixels;
  const double level = std::ceil(std::log2(root / finest) - .01);
  return int(std::clamp(level, 0.0, double(web_mercator::kMaxLevel)));
}

bool has_image(const Surface& surface, web_mercator::Tile tile) {
  if (tile.level > deepest_image_level(surface)) return false;
  const GeoRect rect = web_mercator::rect(tile);
  return std::ranges::any_of(surface.layers(), [&](const SurfaceLayer& layer) {
    const DemInfo& info = layer.source->info();
    if (info.extents.empty()) return info.bounds.overlaps(rect);
    return std::ranges::any_of(info.extents, [&](const GeoRect& e) { return e.overlaps(rect); });
  });
}

Result<HeightImage> height_image(const Surface& surface, web_mercator::Tile tile, int pixels,
                                 std::stop_token stop) {
  HeightImage image{.pixels = pixels,
                    .heights = std::vector<float>(std::size_t(pixels) * pixels),
                    .samples = samples_of(surface, tile, pixels)};
  HeightField field(surface);
  ImageRows rows(tile, image);
  const GeoRect all = web_mercator::rect(tile);
  const std::int64_t posts = posts_in(surface, all);
  const int bands = int(std::clamp<std::int64_t>(posts / kImageBand + 1, 1, pixels));
  for (int band = 0; band < bands; ++band) {
    const int begin = band * pixels / bands, end = (band + 1) * pixels / bands;
    const double side = 1 / std::ldexp(1.0, tile.level);
    const auto lat = [&](int row) {
      return web_mercator::lat_of((tile.y + double(row) / pixels) * side);
    };
    if (auto done = load(field, {all.west, lat(end), all.east, lat(begin)}); !done)
      return std::unexpected(done.error());
    for (int row = begin; row < end; ++row) {
      if (stop.stop_requested())
        return fail(Errc::cancelled, "nobody waits for the image any more");
      rows.fill_in(field, row);
    }
    if (const auto error = field.error()) return std::unexpected(*error);
  }
  return image;
}

}  // namespace tind
