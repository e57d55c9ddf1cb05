// Patch by patch (32 x 32 cells). In a patch the finest residuals come first, from every post.
// Those of coarser cells are mostly decided by bounds: a fine cell whose residual and whose
// surface's distance from the coarser one cannot give more than is known already is passed over, so
// few posts are looked at twice. Posts of layers, which have to be gathered one by one, and may be
// any number in a patch, are not kept: each is held against all sizes of cells as it comes by.

#include "terrain/pyramid/residual/residual_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "terrain/surface/height_field.h"
#include "terrain/surface/rim_samples.h"
#include "terrain/surface/tile_posts.h"

namespace tind {

namespace {

constexpr int kPatches = 8;                                // a side, looked at one after the other
constexpr int kCells = ResidualRecord::kCells / kPatches;  // of a patch, a side
constexpr int kNodes = kCells + 1;
constexpr int kExact = 5;  // 2^5 = 32: the coarsest cell is the patch
constexpr double kExtent = ResidualLattice::kExtent, kSide = kExtent / ResidualRecord::kCells;
constexpr double kHair = 1e-6;  // tile units, as for the posts of a tile

constexpr std::int64_t kMostLoaded = 1 << 20;  // posts of a layer, for the nodes of a patch

using Cells = std::vector<float>;

/// The cells of a patch, a side, that a place so many cells from its corner touches.
struct TouchedCells {
  int first_col, last_col, first_row, last_row;

  TouchedCells(double i, double j)
      : first_col(first(i)), last_col(last(i)), first_row(first(j)), last_row(last(j)) {}
  /// f(col, row); never, of a place outside.
  template <class F>
  void each(F&& f) const {
    for (int row = first_row; row <= last_row; ++row)
      for (int col = first_col; col <= last_col; ++col) f(col, row);
  }

 private:
  static int first(double t) {
    return int(std::clamp(std::floor(t - kHair / kSide), 0.0, double(kCells)));
  }
  static int last(double t) {
    return int(std::clamp(std::floor(t + kHair / kSide), -1.0, double(kCells - 1)));
  }
};

/// The posts of a patch, by cell. A post on a line between cells is in all that touch.
class PatchPosts {
 public:
  /// x, y: the patch's north-western corner in tile coordinates.
  PatchPosts(const TilePosts& posts, double x, double y) {
    posts.visit([&](const auto& samples) { sort_in(samples, x, y); });
  }

  /// f(x, y, z) for the valid posts of a closed cell.
  template <class F>
  void each(int col, int row, F&& f) const {
    if (grid_) {
      const auto [i0, i1] = cols_[std::size_t(col)];
      const auto [j0, j1] = rows_[std::size_t(row)];
      for (int j = j0; j <= j1; ++j) {
        const float* const line = grid_->z + std::size_t(j) * grid_->row_length();
        const double y = grid_->y0 - j * grid_->dy;
        for (int i = i0; i <= i1; ++i)
          if (!std::isnan(line[i])) f(grid_->x0 + i * grid_->dx, y, double(line[i]));
      }
      return;
    }
    const std::size_t c = std::size_t(row) * kCells + std::size_t(col);
    for (std::size_t k = start_[c]; k < start_[c + 1]; ++k) {
      const Vec3& p = points_[k];
      f(p.x, p.y, p.z);
    }
  }

 private:
  struct Run {
    int first = 0, last = -1;
  };
  const GridSamples* grid_ = nullptr;
  std::array<Run, kCells> cols_, rows_;
  std::vector<Vec3> points_;
  std::vector<std::size_t> start_;

  void sort_in(const GridSamples& grid, double x, double y) {
    grid_ = &grid;
    const auto run = [](double from, double to, int count) {
      const double first = std::clamp(std::ceil(from), 0.0, double(count));
      const double last = std::clamp(std::floor(to), -1.0, double(count - 1));
      return Run{int(first), int(last)};
    };
    for (int k = 0; k < kCells; ++k) {
      cols_[std::size_t(k)] = run((x + k * kSide - kHair - grid.x0) / grid.dx,
                                  (x + (k + 1) * kSide + kHair - grid.x0) / grid.dx, grid.cols);
      rows_[std::size_t(k)] = run((grid.y0 - (y - k * kSide) - kHair) / grid.dy,
                                  (grid.y0 - (y - (k + 1) * kSide) + kHair) / grid.dy, grid.rows);
    }
  }

  void sort_in(const ScatteredSamples& posts, double x, double y) {
    const auto each_cell = [&](const Vec3& p, auto&& f) {
      TouchedCells((p.x - x) / kSide, (y - p.y) / kSide).each([&](int col, int row) {
        f(std::size_t(row) * kCells + std::size_t(col));
      });
    };
    start_.assign(std::size_t(kCells) * kCells + 1, 0);
    for (std::size_t k = 0; k < posts.size(); ++k)
      each_cell(posts.sample(k), [&](std::size_t c) { ++start_[c + 1]; });
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    points_.resize(start_.back());
    auto next = start_;
    for (std::size_t k = 0; k < posts.size(); ++k) {
      const Vec3 p = posts.sample(k);
      each_cell(p, [&](std::size_t c) { points_[next[c]++] = p; });
    }
  }
};

class TileScan {
 public:
  TileScan(const Surface& surface, TileId id, double step_m)
      : surface_(surface), id_(id), rect_(tiling::rect(id)), step_(step_m), field_(surface) {}

  Result<ResidualRecord> run(std::stop_token stop) {
    record_.heights.assign(std::size_t(ResidualRecord::kNodes) * ResidualRecord::kNodes, 0);
    for (int k = 0; k <= kExact; ++k) {
      const std::size_t side = std::size_t(ResidualRecord::kCells >> k);
      record_.pieces[std::size_t(k)].assign(side * side, ResidualRecord::kEmpty);
    }
    for (int row = 0; row < kPatches; ++row)
      for (int col = 0; col < kPatches; ++col) {
        if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
        if (auto done = patch(col, row); !done) return fail("tile " + id_.text(), done.error());
      }
    if (!record_.has_posts()) {
      ResidualRecord empty;
      if (std::ranges::any_of(record_.heights, [](std::int32_t h) { return h != 0; }))
        empty.heights = std::move(record_.heights);
      return empty;
    }
    for (int k = kExact + 1; k < ResidualRecord::kPieces; ++k) accumulate_piece(record_, k, step_);
    return std::move(record_);
  }

 private:
  const Surface& surface_;
  const TileId id_;
  const GeoRect rect_;
  const double step_;
  HeightField field_;
  ResidualRecord record_;

  Geographic place(int col, int row) const {
    const auto mix = [](double a, double b, int k) {
      return k == ResidualRecord::kCells ? b : a + (b - a) * k / ResidualRecord::kCells;
    };
    return {mix(rect_.west, rect_.east, col), mix(rect_.north, rect_.south, row)};
  }

  /// Node of the patch -> metres.
  using Nodes = std::array<double, std::size_t(kNodes) * kNodes>;

  Result<void> patch(int patch_col, int patch_row) {
    const int col0 = patch_col * kCells, row0 = patch_row * kCells;
    const Geographic nw = place(col0, row0), se = place(col0 + kCells, row0 + kCells);
    const GeoRect rect{nw.lon, se.lat, se.lon, nw.lat};
    const auto found = surface_windows(surface_, rect);
    if (!found) return std::unexpected(found.error());
    const std::vector<LayerWindow>& windows = *found;
    for (const auto& [layer, w, step, alone] : windows) {
      if (!surface_.only() && w.cols > kMostLoaded / w.rows) continue;
      auto loaded = field_.load(layer, w.col, w.row, int(w.cols), int(w.rows));
      if (!loaded) return loaded;
    }
    Nodes nodes;
    if (auto done = find_nodes(col0, row0, nodes); !done) return done;
    if (windows.empty()) return {};
    auto residuals = surface_.only()
                         ? residuals_of_one(windows, patch_col, patch_row, nodes)
                         : residuals_of_layers(windows, rect, patch_col, patch_row, nodes);
    if (!residuals) return std::unexpected(residuals.error());
    for (int k = 0; k < int(residuals->size()); ++k) {
      const int side = kCells >> k, stride = ResidualRecord::kCells >> k;
      for (int row = 0; row < side; ++row)
        std::copy_n(&(*residuals)[std::size_t(k)][std::size_t(row) * side], side,
                    &record_.pieces[std::size_t(k)][std::size_t(patch_row * side + row) * stride +
                                                    patch_col * side]);
    }
    return {};
  }

  /// By size of cells, the smallest first; nothing where there is no post.
  Result<std::vector<Cells>> residuals_of_one(const std::vector<LayerWindow>& windows,
                                              int patch_col, int patch_row, const Nodes& nodes) {
    std::vector<Cells> residuals;
    const auto posts = TilePosts::read(field_, windows, id_);
    if (!posts) return std::unexpected(posts.error());
    if (posts->inside() == 0) return residuals;
    const double x = patch_col * kCells * kSide, y = kExtent - patch_row * kCells * kSide;
    const PatchPosts by_cell(*posts, x, y);
    count(by_cell, patch_col, patch_row);
    residuals.push_back(finest(by_cell, nodes, x, y));
    for (int k = 1; k <= kExact; ++k)
      residuals.push_back(coarser(by_cell, nodes, x, y, residuals[0], k));
    return residuals;
  }

  Result<std::vector<Cells>> residuals_of_layers(const std::vector<LayerWindow>& windows,
                                                 const GeoRect& rect, int patch_col, int patch_row,
                                                 const Nodes& nodes) {
    const double x = patch_col * kCells * kSide, y = kExtent - patch_row * kCells * kSide;
    std::vector<std::vector<double>> worst;
    for (int k = 0; k <= kExact; ++k)
      worst.emplace_back(std::size_t(kCells >> k) * std::size_t(kCells >> k),
                         double(ResidualRecord::kEmpty));
    const auto take = [&](const Vec3& p, bool counts) {
      TouchedCells((p.x - x) / kSide, (y - p.y) / kSide).each([&](int col, int row) {
        for (int k = 0; k <= kExact; ++k) {
          const int i = col >> k, j = row >> k;
          double& cell = worst[std::size_t(k)][std::size_t(j) * (kCells >> k) + i];
          cell = std::max(cell, std::abs(surface(nodes, x, y, i, j, 1 << k).at(p.x, p.y) - p.z));
        }
        const int i = patch_col * kCells + col, j = patch_row * kCells + row;
        if (counts && is_of(i, j, p.x, p.y)) count_post(i, j, p);
        record_.min_m = std::min(record_.min_m, float(p.z));
        record_.max_m = std::max(record_.max_m, float(p.z));
      });
    };
    for (const LayerWindow& window : windows)
      for (const LayerWindow& part : parts_of(window)) {
        const auto posts = TilePosts::read(field_, {&part, 1}, id_);
        if (!posts) return std::unexpected(posts.error());
        posts->visit([&](const auto& samples) {
          for (std::size_t n = 0; n < samples.size(); ++n)
            if (const Vec3 p = samples.sample(n); !std::isnan(p.z)) take(p, true);
        });
      }
    if (windows.size() > 1 || !windows.front().alone) {
      const auto rims = rim_samples(field_, rect, rect_.height());
      if (!rims) return std::unexpected(rims.error());
      for (const Vec3& p : *rims)  // from the grid of the patch into that of the tile
        take({x + p.x / kPatches, y - (kExtent - p.y) / kPatches, p.z}, false);
    }
    std::vector<Cells> residuals;
    for (const std::vector<double>& cells : worst) {
      Cells& rounded = residuals.emplace_back();
      for (const double w : cells) rounded.push_back(rounded_up(w));
    }
    return residuals;
  }

  Result<void> find_nodes(int col0, int row0, Nodes& nodes) {
    std::vector<Geographic> places;
    for (int row = 0; row < kNodes; ++row)
      for (int col = 0; col < kNodes; ++col) places.push_back(place(col0 + col, row0 + row));
    field_.filled(places, nodes);
    if (field_.error()) return std::unexpected(*field_.error());
    for (int row = 0; row < kNodes; ++row)
      for (int col = 0; col < kNodes; ++col) {
        double& h = nodes[std::size_t(row) * kNodes + col];
        if (std::abs(h / step_) > ResidualRecord::kMostSteps)
          return fail(Errc::unsupported,
                      fmt::format("a height of {:g} m is beyond what the residual index of this "
                                  "DEM can hold, {:g} m: where it means no data say --nodata "
                                  "VALUE; --exact-posts with a larger number makes do without",
                                  h, step_ * ResidualRecord::kMostSteps));
        const auto steps = std::int32_t(std::lround(h / step_));
        record_
            .heights[std::size_t(row0 + row) * ResidualRecord::kNodes + std::size_t(col0 + col)] =
            steps;
        h = steps * step_;
      }
    return {};
  }

  /// Of the cells that a post is in, the one to its north-east has it: is it this one?
  static bool is_of(int col, int row, double x, double y) {
    const bool on_east = x >= (col + 1) * kSide - kHair;
    const bool on_north = y >= kExtent - row * kSide - kHair;
    return !(on_east && col + 1 < ResidualRecord::kCells) && !(on_north && row > 0);
  }

  /// REQUIRES: is_of() the cell.
  void count_post(int col, int row, const Vec3& p) {
    const bool on_east = p.x >= (col + 1) * kSide - kHair;
    const bool on_north = p.y >= kExtent - row * kSide - kHair;
    record_.min_m = std::min(record_.min_m, float(p.z));
    record_.max_m = std::max(record_.max_m, float(p.z));
    ++(on_east && on_north ? record_.on_corner
       : on_east           ? record_.on_east
       : on_north          ? record_.on_north
                           : record_.owned);
  }

  /// Each post once.
  void count(const PatchPosts& posts, int patch_col, int patch_row) {
    for (int row = 0; row < kCells; ++row)
      for (int col = 0; col < kCells; ++col)
        posts.each(col, row, [&](double x, double y, double z) {
          const int i = patch_col * kCells + col, j = patch_row * kCells + row;
          if (is_of(i, j, x, y)) count_post(i, j, {x, y, z});
        });
  }

  static LatticeCell surface(const Nodes& nodes, double x, double y, int col, int row, int cell) {
    const auto h = [&](int i, int j) {
      return nodes[std::size_t(row + j) * cell * kNodes + (col + i) * cell];
    };
    return {h(0, 1),
            h(1, 1),
            h(0, 0),
            h(1, 0),
            x + col * cell * kSide,
            y - (row + 1) * cell * kSide,
            cell * kSide};
  }

  /// The largest |post - surface| among the posts of a cell, rounded up; kEmpty without posts.
  static float worst_of(const PatchPosts& posts, int col, int row, const LatticeCell& surface) {
    double worst = ResidualRecord::kEmpty;
    posts.each(col, row, [&](double x, double y, double z) {
      worst = std::max(worst, std::abs(surface.at(x, y) - z));
    });
    return rounded_up(worst);
  }

  static float rounded_up(double worst) {
    return worst < 0 ? ResidualRecord::kEmpty : std::nextafter(float(worst), HUGE_VALF);
  }

  static Cells finest(const PatchPosts& posts, const Nodes& nodes, double x, double y) {
    Cells cells(std::size_t(kCells) * kCells);
    for (int row = 0; row < kCells; ++row)
      for (int col = 0; col < kCells; ++col)
        cells[std::size_t(row) * kCells + col] =
            worst_of(posts, col, row, surface(nodes, x, y, col, row, 1));
    return cells;
  }

  static Cells coarser(const PatchPosts& posts, const Nodes& nodes, double x, double y,
                       const Cells& fine, int k) {
    const int side = kCells >> k, cell = 1 << k;
    Cells cells(std::size_t(side) * std::size_t(side), ResidualRecord::kEmpty);
    std::vector<float> limits(std::size_t(cell) * std::size_t(cell));
    for (int row = 0; row < side; ++row)
      for (int col = 0; col < side; ++col) {
        const LatticeCell plane = surface(nodes, x, y, col, row, cell);
        const auto fine_cell = [&](int n) {
          return std::pair(col * cell + n % cell, row * cell + n / cell);
        };
        int likely = -1;
        for (int n = 0; n < cell * cell; ++n) {
          const auto [i, j] = fine_cell(n);
          limits[std::size_t(n)] = limit(nodes, x, y, fine, i, j, plane);
          if (likely < 0 || limits[std::size_t(n)] > limits[std::size_t(likely)]) likely = n;
        }
        float& worst = cells[std::size_t(row) * side + col];
        const auto look = [&](int n) {
          if (limits[std::size_t(n)] <= worst) return;
          const auto [i, j] = fine_cell(n);
          worst = std::max(worst, worst_of(posts, i, j, plane));
        };
        look(likely);
        for (int n = 0; n < cell * cell; ++n)
          if (n != likely) look(n);
      }
    return cells;
  }

  /// No post of a fine cell is farther than this from the coarser surface.
  static float limit(const Nodes& nodes, double x, double y, const Cells& fine, int col, int row,
                     const LatticeCell& coarse) {
    const float own = fine[std::size_t(row) * kCells + col];
    if (own < 0) return ResidualRecord::kEmpty;
    double apart = 0;
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i)
        apart = std::max(apart, std::abs(nodes[std::size_t(row + j) * kNodes + col + i] -
                                         coarse.at(x + (col + i) * kSide, y - (row + j) * kSide)));
    return std::nextafter(float(own + apart + 1e-9), HUGE_VALF);
  }
};

}  // namespace

Result<ResidualRecord> scan_residuals(const Surface& surface, TileId id, double step_m,
                                      std::stop_token stop) {
  return TileScan(surface, id, step_m).run(std::move(stop));
}

}  // namespace tind
