// Bands of rows, each with the posts that it needs in memory where it needs most of them; a band
// with few samples over many posts (a coarse raster of a fine DEM) reads what it asks for.

#include "terrain/heightmaps/height_lattice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "terrain/base/parallel.h"
#include "terrain/geo/longitude.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/tile_posts.h"

namespace tind {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kMostSamples = 8;                             // of H a post, along each axis
constexpr std::int64_t kBandPosts = std::int64_t(1) << 22;  // of a layer in memory, about
constexpr std::int64_t kPostsPerSample = 64;  // more are not read as a window, but where asked for
constexpr int kBandRows = 32;

/// Of a post, along its row and its column.
struct Samples {
  int across = 1, down = 1;
};

Samples samples_of(const Surface& surface, Vec2 spacing_m) {
  Vec2 finest{HUGE_VAL, HUGE_VAL};
  for (const SurfaceLayer& layer : surface.layers())
    finest = {std::min(finest.x, layer.spacing_m.x), std::min(finest.y, layer.spacing_m.y)};
  const auto dense = [](double ours, double theirs) {  // 1.5 % more is not worth a sample
    return int(std::clamp(std::ceil(ours / theirs - .015), 1.0, double(kMostSamples)));
  };
  return {dense(spacing_m.x, finest.x), dense(spacing_m.y, finest.y)};
}

/// The rectangle of rows [begin, end) with the cells around their posts.
GeoRect rect_of(const RasterLattice& lattice, int begin, int end) {
  GeoRect rect{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  std::vector<Geographic> places;
  const auto add = [&](double row, double first, std::size_t count) {
    places.resize(count);
    lattice.places(row, first, places);
    for (Geographic p : places) {
      if (!std::isfinite(p.lon) || !std::isfinite(p.lat)) continue;
      p = within_first_turn(p);
      rect = {std::min(rect.west, p.lon), std::min(rect.south, p.lat), std::max(rect.east, p.lon),
              std::max(rect.north, p.lat)};
    }
  };
  add(begin - .5, -.5, std::size_t(lattice.cols) + 1);
  add(end - .5, -.5, std::size_t(lattice.cols) + 1);
  for (int row = begin; row < end; ++row) add(row, -.5, 1), add(row, lattice.cols - .5, 1);
  return rect;
}

/// A few rows of the raster.
class RowMaker {
 public:
  RowMaker(const Surface& surface, const RasterLattice& lattice, Samples samples, bool fill,
           LatticeHeights& out)
      : field_(surface),
        lattice_(lattice),
        fill_(fill),
        across_(samples.across),
        down_(samples.down),
        out_(out) {}

  Result<void> make(int begin, int end, const std::stop_token& stop) {
    if (auto done = load(begin, end); !done) return done;
    for (int row = begin; row < end; ++row) {
      if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
      make_row(row);
    }
    if (const auto error = field_.error()) return std::unexpected(*error);
    return {};
  }

  double max_deviation_m = 0;
  std::uint64_t without_height = 0;

 private:
  HeightField field_;
  const RasterLattice& lattice_;
  const bool fill_;
  const int across_, down_;
  LatticeHeights& out_;
  std::vector<Geographic> edges_, places_;
  std::vector<double> heights_;

  Result<void> load(int begin, int end) {
    const GeoRect rect = rect_of(lattice_, begin, end);
    const std::int64_t samples = std::int64_t(lattice_.cols) * (end - begin) * across_ * down_;
    const Surface& surface = field_.surface();
    for (std::size_t k = 0; k < surface.layers().size(); ++k) {
      if (!(rect.west < rect.east) || !surface.reaches(k, rect)) continue;
      const PostWindow w = post_window(*surface.layers()[k].source, rect);
      if (w.empty() || w.cols * w.rows > std::max(kBandPosts, kPostsPerSample * samples)) continue;
      if (auto done = field_.load(k, w.col - 1, w.row - 1, int(w.cols) + 2, int(w.rows) + 2); !done)
        return done;
    }
    return {};
  }

  /// The places of each post along one line of its row. Between the ends of a cell, straight.
  void place_line(double row) {
    const int cols = lattice_.cols;
    places_.resize(std::size_t(cols) * std::size_t(across_));
    if (across_ == 1) {
      lattice_.places(row, 0, places_);
    } else {
      edges_.resize(std::size_t(cols) + 1);
      lattice_.places(row, -.5, edges_);
      for (int c = 0; c < cols; ++c) {
        const Geographic a = edges_[std::size_t(c)], b = edges_[std::size_t(c) + 1];
        const double east = b.lon - a.lon - 360 * std::round((b.lon - a.lon) / 360);
        for (int i = 0; i < across_; ++i) {
          const double t = (i + .5) / across_;
          places_[std::size_t(c) * std::size_t(across_) + std::size_t(i)] = {
              a.lon + t * east, a.lat + t * (b.lat - a.lat)};
        }
      }
    }
    for (Geographic& p : places_) p = within_first_turn(p);
  }

  void make_row(int row) {
    const auto wide = std::size_t(lattice_.cols) * std::size_t(across_);
    heights_.resize(wide * std::size_t(down_));
    for (int j = 0; j < down_; ++j) {
      place_line(row - .5 + (j + .5) / down_);
      field_.at(places_, std::span(heights_).subspan(std::size_t(j) * wide, wide));
    }
    float* const out = &out_.heights[std::size_t(row) * std::size_t(lattice_.cols)];
    std::vector<int> empty;
    for (int c = 0; c < lattice_.cols; ++c) {
      const double mean = mean_of(c);
      out[c] = float(mean);
      if (std::isnan(mean)) empty.push_back(c);
    }
    without_height += empty.size();
    if (fill_ && !empty.empty()) fill_in(row, empty, out);
  }

  template <class F>
  void each_sample(int col, const F& f) const {
    const auto n = std::size_t(across_), wide = std::size_t(lattice_.cols) * n;
    for (std::size_t j = 0; j < std::size_t(down_); ++j)
      for (std::size_t i = 0; i < n; ++i) {
        const double h = heights_[j * wide + std::size_t(col) * n + i];
        if (!std::isnan(h)) f(h);
      }
  }

  double mean_of(int col) {
    double sum = 0;
    int count = 0;
    each_sample(col, [&](double h) { sum += h, ++count; });
    if (count == 0) return kNaN;
    const double mean = sum / count;
    each_sample(col,
                [&](double h) { max_deviation_m = std::max(max_deviation_m, std::abs(h - mean)); });
    return mean;
  }

  void fill_in(int row, const std::vector<int>& empty, float* out) {
    std::vector<Geographic> posts(std::size_t(lattice_.cols)), asked;
    lattice_.places(row, 0, posts);
    for (const int c : empty) asked.push_back(within_first_turn(posts[std::size_t(c)]));
    std::vector<double> filled(asked.size());
    field_.filled(asked, filled);
    for (std::size_t k = 0; k < empty.size(); ++k)
      out[empty[k]] = std::isnan(filled[k]) ? 0.f : float(filled[k]);
  }
};

}  // namespace

Result<LatticeHeights> lattice_heights(const Surface& surface, const RasterLattice& lattice,
                                       const LatticeOptions& options, const Progress& progress) {
  LatticeHeights out;
  const Samples samples = samples_of(surface, lattice.spacing_m);
  out.samples = samples.across * samples.down;
  out.heights.resize(std::size_t(lattice.cols) * std::size_t(lattice.rows));
  const std::size_t bands = std::size_t(lattice.rows + kBandRows - 1) / kBandRows;
  std::mutex mutex;  // of the error and the sums
  std::optional<Error> first_error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  parallel_for(bands, options.threads, [&](std::size_t b) {
    if (give_up || progress.stopped()) return;
    RowMaker maker(surface, lattice, samples, options.fill, out);
    const int begin = int(b) * kBandRows, end = std::min(begin + kBandRows, lattice.rows);
    const auto made = maker.make(begin, end, progress.stop);
    const std::lock_guard lock(mutex);
    if (!made && !first_error) first_error = made.error(), give_up = true;
    out.max_deviation_m = std::max(out.max_deviation_m, maker.max_deviation_m);
    out.without_height += maker.without_height;
    progress.at(double(++done) / double(bands));
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped before the heights were made");
  if (first_error) return std::unexpected(*first_error);
  return out;
}

}  // namespace tind
