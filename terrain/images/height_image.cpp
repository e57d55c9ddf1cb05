// What a pixel says of the places in it.

#include "terrain/images/height_image.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "terrain/images/sample_lattice.h"

namespace tind {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double spacing_m(const DemInfo& info) { return std::min(info.spacing_x_m, info.spacing_y_m); }

/// One row of the image at a time: where H is asked, and what becomes of the answers.
class ImageRows {
 public:
  ImageRows(SampleLattice& lattice, HeightImage& image)
      : lattice_(lattice),
        image_(image),
        heights_(std::size_t(lattice.side()) * std::size_t(lattice.samples())) {}

  void fill_in(int row) {
    const int n = image_.samples;
    const auto wide = std::size_t(lattice_.side());
    for (int j = 0; j < n; ++j)
      lattice_.heights(row * n + j, 0, std::span(heights_).subspan(std::size_t(j) * wide, wide));
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
    fill_empty(row, out);
  }

 private:
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

  void fill_empty(int row, float* out) {
    filled_ += empty_.size();
    image_.filled_share = double(filled_) / double(image_.heights.size());
    // What is far from all posts stays 0.
    std::erase_if(empty_, [&](int x) { return !lattice_.may_fill(lattice_.centre_of(x, row)); });
    if (empty_.empty()) return;
    std::vector<Geographic> centres;
    centres.reserve(empty_.size());
    for (const int x : empty_) centres.push_back(lattice_.centre_of(x, row));
    std::vector<double> filled(centres.size());
    lattice_.field().filled(centres, filled);
    for (std::size_t k = 0; k < empty_.size(); ++k)
      out[empty_[k]] = std::isnan(filled[k]) ? 0.f : float(filled[k]);
  }

  SampleLattice& lattice_;
  HeightImage& image_;
  std::vector<double> heights_;
  std::vector<int> empty_;
  std::size_t filled_ = 0;
};

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

bool has_images(const Surface& surface) { return has_image(surface, {0, 0, 0}); }

Result<HeightImage> height_image(const Surface& surface, web_mercator::Tile tile, int pixels,
                                 std::stop_token stop) {
  SampleLattice lattice(surface, tile, pixels);
  HeightImage image{.pixels = pixels,
                    .heights = std::vector<float>(std::size_t(pixels) * pixels),
                    .samples = lattice.samples()};
  ImageRows rows(lattice, image);
  const auto done = lattice.each_pixel_row(0, stop, [&](int row) { rows.fill_in(row); });
  if (!done) return std::unexpected(done.error());
  return image;
}

}  // namespace tind
