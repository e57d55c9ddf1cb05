// Bands of rows, cut into pieces with so few posts under each that they can be in memory; a piece
// with few samples over many posts (a coarse raster of a fine DEM) reads what it asks for, and that
// in its own small area, so that what was decoded for one row is still there for the next.

#include "terrain/heightmaps/height_lattice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "terrain/base/parallel.h"
#include "terrain/geo/longitude.h"
#include "terrain/heightmaps/lattice_pieces.h"
#include "terrain/surface/height_field.h"

namespace tind {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kMostSamples = 8;                            // of H a post, along each axis
constexpr std::int64_t kFewPosts = std::int64_t(1) << 22;  // of a layer are always read as a window
constexpr std::int64_t kPostsPerSample = 64;  // more are not read as a window, but where asked for
constexpr std::int64_t kBlockPosts = std::int64_t(1) << 16;  // decoded for one, dem_source.cpp
constexpr int kBandRows = 32;
constexpr int kLineSamples = 1 << 17;  // of one line across a piece

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

std::int64_t count_of(Samples samples, const LatticePiece& piece) {
  return std::int64_t(piece.cols) * piece.rows * samples.across * samples.down;
}

/// So few posts for so many samples that reading all of them is the faster way.
bool is_dense(const LayerPosts& posts, std::int64_t samples) {
  return posts.count() <= std::max(kFewPosts, kPostsPerSample * samples);
}

/// Bands from the north, in pieces.
Result<void> cut_band(const Surface& surface, const RasterLattice& lattice, Samples samples,
                      std::size_t band, std::int64_t most_held, const TakePiece& take) {
  const int begin = int(band) * kBandRows, end = std::min(begin + kBandRows, lattice.rows);
  return cut_piece(surface, lattice, {0, begin, lattice.cols, end - begin},
                   {most_held, kLineSamples / samples.across}, take);
}

std::size_t bands_of(const RasterLattice& lattice) {
  return std::size_t(lattice.rows + kBandRows - 1) / kBandRows;
}

/// The heights of a piece.
class PieceMaker {
 public:
  PieceMaker(const Surface& surface, const RasterLattice& lattice, Samples samples,
             const LatticePiece& piece, LatticeHeights& out)
      : field_(surface),
        lattice_(lattice),
        piece_(piece),
        across_(samples.across),
        down_(samples.down),
        out_(out) {}

  Result<void> make(std::span<const LayerPosts> under, const LatticeOptions& options,
                    const std::stop_token& stop) {
    if (auto done = load(under, options.most_held); !done) return done;
    for (int row = piece_.row; row < piece_.row + piece_.rows; ++row) {
      if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
      make_row(row, options.fill);
      if (const auto error = field_.error()) return std::unexpected(*error);
    }
    return {};
  }

  double max_deviation_m = 0;
  std::uint64_t without_height = 0;

 private:
  HeightField field_;
  const RasterLattice& lattice_;
  const LatticePiece piece_;
  const int across_, down_;
  LatticeHeights& out_;
  std::vector<Geographic> edges_, places_;
  std::vector<double> heights_;

  /// Of a single cell not even the posts of one layer may fit.
  Result<void> load(std::span<const LayerPosts> under, std::int64_t room) {
    const std::int64_t samples = count_of({across_, down_}, piece_);
    for (const LayerPosts& posts : under) {
      if (posts.count() > room || !is_dense(posts, samples)) continue;
      room -= posts.count();
      if (auto done =
              field_.load(posts.layer, posts.col, posts.row, int(posts.cols), int(posts.rows));
          !done)
        return done;
    }
    return {};
  }

  /// The places of each post along one line of its row. Between the ends of a cell, straight.
  void place_line(double row) {
    const int cols = piece_.cols;
    places_.resize(std::size_t(cols) * std::size_t(across_));
    if (across_ == 1) {
      lattice_.places(row, piece_.col, places_);
    } else {
      edges_.resize(std::size_t(cols) + 1);
      lattice_.places(row, piece_.col - .5, edges_);
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

  void make_row(int row, bool fill) {
    const auto wide = std::size_t(piece_.cols) * std::size_t(across_);
    heights_.resize(wide * std::size_t(down_));
    for (int j = 0; j < down_; ++j) {
      place_line(row - .5 + (j + .5) / down_);
      field_.at(places_, std::span(heights_).subspan(std::size_t(j) * wide, wide));
    }
    float* const out =
        &out_.heights[std::size_t(row) * std::size_t(lattice_.cols) + std::size_t(piece_.col)];
    std::vector<int> empty;
    for (int c = 0; c < piece_.cols; ++c) {
      const double mean = mean_of(c);
      out[c] = float(mean);
      if (std::isnan(mean)) empty.push_back(c);
    }
    without_height += empty.size();
    if (fill && !empty.empty()) fill_in(row, empty, out);
  }

  template <class F>
  void each_sample(int col, const F& f) const {
    const auto n = std::size_t(across_), wide = std::size_t(piece_.cols) * n;
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
    std::vector<Geographic> posts(std::size_t(piece_.cols)), asked;
    lattice_.places(row, piece_.col, posts);
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
  const std::size_t bands = bands_of(lattice);
  std::mutex mutex;  // of the error and the sums
  std::optional<Error> first_error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  const auto make = [&](const LatticePiece& piece,
                        std::span<const LayerPosts> under) -> Result<void> {
    if (give_up || progress.stopped()) return fail(Errc::cancelled, "stopped");
    PieceMaker maker(surface, lattice, samples, piece, out);
    if (auto made = maker.make(under, options, progress.stop); !made) return made;
    const std::lock_guard lock(mutex);
    out.max_deviation_m = std::max(out.max_deviation_m, maker.max_deviation_m);
    out.without_height += maker.without_height;
    return {};
  };
  parallel_for(bands, options.threads, [&](std::size_t band) {
    if (give_up || progress.stopped()) return;
    const auto made = cut_band(surface, lattice, samples, band, options.most_held, make);
    const std::lock_guard lock(mutex);
    if (!made && !first_error) first_error = made.error(), give_up = true;
    progress.at(double(++done) / double(bands));
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped before the heights were made");
  if (first_error) return std::unexpected(*first_error);
  return out;
}

bool takes_more_posts(const Surface& surface, const RasterLattice& lattice, double posts,
                      const std::stop_token& stop) {
  if (double(surface.post_count()) <= posts) return false;
  const Samples samples = samples_of(surface, lattice.spacing_m);
  double sum = 0;
  const auto add = [&](const LatticePiece& piece,
                       std::span<const LayerPosts> under) -> Result<void> {
    const std::int64_t asked = count_of(samples, piece);
    for (const LayerPosts& p : under)
      sum += double(is_dense(p, asked) ? p.count() : std::min(p.count(), asked * kBlockPosts));
    if (sum > posts || stop.stop_requested()) return fail(Errc::cancelled, "enough is known");
    return {};
  };
  for (std::size_t band = 0; band < bands_of(lattice); ++band)
    if (!cut_band(surface, lattice, samples, band, LatticeOptions().most_held, add)) break;
  return sum > posts;
}

}  // namespace tind
