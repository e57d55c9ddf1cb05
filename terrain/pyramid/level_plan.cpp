#include "terrain/pyramid/level_plan.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>

#include "terrain/base/parallel.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/residual_index.h"
#include "terrain/pyramid/source_blocks.h"

namespace tind {

namespace {

constexpr int kTileCells = 64;         // the leaf level's grid is at least as fine as the source
constexpr double kLargestError = 500;  // metres; a globe seen from afar still has its mountains
constexpr double kBorderShare = 0.85, kCoarseBorderShare = 0.5;  // of the error that a fit may have
constexpr double kLargestStep = 1;            // metres; no reason to round heights more coarsely
constexpr double kSmallestStep = 1.0 / 1024;  // float32 headers hold its multiples up to 16 km

double power_of_two_at_most(double x) { return std::exp2(std::floor(std::log2(x))); }
double power_of_two_at_least(double x) { return std::exp2(std::ceil(std::log2(x))); }

int leaf_level(const DemInfo& info) {
  const double lat = (info.bounds.south + info.bounds.north) / 2;
  const Vec2 degree = wgs84::metres_per_degree(std::clamp(lat, -80.0, 80.0));
  const double spacing = std::min(info.spacing_x_m / degree.x, info.spacing_y_m / degree.y);
  for (int z = 0; z < tiling::kMaxLevel; ++z)
    if (tiling::tile_degrees(z) / kTileCells <= spacing * (1 + 1e-6)) return z;
  return tiling::kMaxLevel;
}

}  // namespace

// Clients draw triangles straight through space. So that a tile's chord stays within a quarter of
// its level's error above the ellipsoid, coarse tiles keep a lattice of n cells a side:
// sagitta R (pi / (2^z n))^2 / 8 <= level_error(z) / 4.
int curvature_cells(int level) {
  const double angle = std::numbers::pi / double(1u << level);
  const double cells = angle * std::sqrt(wgs84::kSemiMajor / 8 / (tiling::level_error(level) / 4));
  return cells <= 1 ? 1 : int(power_of_two_at_least(cells));
}

int place_step(const DemInfo& info, int level, double eps, int step) {
  const double spacing = std::min(info.spacing_x_m, info.spacing_y_m) * step;
  const double degrees = std::min(spacing / 4, eps) / 111320;
  const double units = degrees / tiling::tile_degrees(level) * 32767;
  return int(std::clamp(power_of_two_at_most(std::max(units, 1.0)), 1.0, 64.0));
}

void HeightRange::add(std::span<const float> posts) {
  float low = HUGE_VALF, high = -HUGE_VALF;
  for (const float z : posts) {
    if (z < low) low = z;  // a void is neither below nor above
    if (z > high) high = z;
    valid += !std::isnan(z);
  }
  min_m = std::min<double>(min_m, low);
  max_m = std::max<double>(max_m, high);
}

Result<HeightRange> read_height_range(const DemSource& source, const Progress& progress,
                                      int threads, SourceBlocks* blocks) {
  constexpr std::int64_t kRows = 256, kCols = 4096;  // whole blocks of the source, 4 MB
  const DemInfo& info = source.info();
  const std::int64_t across = (info.cols + kCols - 1) / kCols,
                     down = (info.rows + kRows - 1) / kRows;
  HeightRange range{HUGE_VAL, -HUGE_VAL, 0};
  std::optional<std::pair<std::size_t, Error>> first_error;
  std::size_t done = 0;
  std::mutex mutex;
  parallel_for(std::size_t(across * down), threads, [&](std::size_t i) {
    if (progress.stopped()) return;
    const std::int64_t row = std::int64_t(i) / across * kRows,
                       col = std::int64_t(i) % across * kCols;
    const auto grid = source.read(col, row, int(std::min(kCols, info.cols - col)),
                                  int(std::min(kRows, info.rows - row)));
    HeightRange part{HUGE_VAL, -HUGE_VAL, 0};
    if (grid) {
      if (blocks) blocks->add(col, row, *grid);
      part.add(grid->values());
    }
    const std::lock_guard lock(mutex);
    if (!grid && (!first_error || i < first_error->first)) first_error.emplace(i, grid.error());
    range.min_m = std::min(range.min_m, part.min_m);
    range.max_m = std::max(range.max_m, part.max_m);
    range.valid += part.valid;
    if (++done % std::max<std::int64_t>(1, across * down / 200) == 0)
      progress.at(double(done) / double(across * down));
  });
  if (first_error) return std::unexpected(first_error->second);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped while reading heights");
  return range;
}

Result<HeightRange> scan_heights(const DemSource& source, const Progress& progress, int threads,
                                 SourceBlocks* blocks) {
  auto range = read_height_range(source, progress, threads, blocks);
  if (range && range->valid == 0)
    return fail(Errc::bad_data, "the DEM holds no valid height at all");
  return range;
}

Result<TilePlan> TilePlan::make(const DemInfo& info, const HeightRange& range,
                                const TileSetOptions& options) {
  if (info.crs_kind == CrsKind::none) {
    return fail(Errc::unsupported, info.files.front() +
                                       " has no coordinate reference system, so its place on the "
                                       "globe is unknown: it can be simplified, but not tiled "
                                       "(assign one, e.g. gdal_edit.py -a_srs EPSG:4326)");
  }
  if (!(options.error_factor > 0) || !(options.max_error_m >= 0))
    return fail(Errc::invalid_argument, "error bounds must be positive numbers of metres");
  if (options.side != "both" && options.side != "above" && options.side != "below")
    return fail(Errc::invalid_argument, "--side is both, above or below, not " + options.side);
  TilePlan plan;
  plan.options_ = options;
  plan.range_ = range;
  plan.bounds_ = info.bounds;
  plan.max_level_ = options.max_level >= 0 ? options.max_level : leaf_level(info);
  plan.min_level_ = options.min_level;
  if (plan.max_level_ > tiling::kMaxLevel || plan.min_level_ < 0 ||
      plan.min_level_ > plan.max_level_) {
    return fail(Errc::invalid_argument,
                "levels must lie in 0-" + std::to_string(tiling::kMaxLevel) + ", lower end first");
  }
  const double spacing = std::sqrt(info.spacing_x_m * info.spacing_y_m);
  const double leaf_error = options.max_error_m > 0 ? options.max_error_m : spacing / 32;
  const double latitude_degree = 111320;
  for (int z = 0; z <= plan.max_level_; ++z) {
    LevelPlan level;
    level.budget_m = tiling::level_error(z) * options.error_factor;
    if (z == plan.max_level_) level.budget_m = std::min(level.budget_m, leaf_error);
    level.fit_error_m = std::min(level.budget_m, kLargestError);
    if (options.side != "both") {
      level.fit_error_m /= 2;
      level.offset_m = options.side == "above" ? level.fit_error_m : -level.fit_error_m;
    }
    // Heights of a tile: posts, 0 where there are none, and half a band beyond either.
    const double relief = std::max(range.max_m, 0.0) - std::min(range.min_m, 0.0) +
                          2 * (level.fit_error_m + std::abs(level.offset_m)) + 4 * kLargestStep;
    const double needed = power_of_two_at_least(std::max(relief, 1.0) / 32767);
    level.border_step_m =
        std::clamp(power_of_two_at_most(level.fit_error_m / 16), std::max(needed, kSmallestStep),
                   std::max(needed, kLargestStep));
    level.border_tolerance_m = kBorderShare * level.fit_error_m;
    level.border_place_step = place_step(info, z, level.fit_error_m);
    level.curvature_cells = curvature_cells(z);
    level.normal_reach_deg = std::max(spacing / latitude_degree, tiling::tile_degrees(z) / 128);
    plan.levels_.push_back(level);
  }
  return plan;
}

void TilePlan::use(std::shared_ptr<const ResidualIndex> index) {
  index_ = std::move(index);
  for (int z = 0; z <= std::min(max_level_, index_->level()); ++z) {
    LevelPlan& level = levels_[std::size_t(z)];
    // What lies between nodes or skipped posts comes on top of a mesh's error, beside its border
    // too, where nothing can be done about it.
    level.border_tolerance_m = kCoarseBorderShare * level.fit_error_m;
    // Tiles of millions of posts have thousands along a border. The coarser ones need not be looked
    // at so closely: their budgets are larger than what lies between samples.
    if (z >= index_->level() - 3) level.border_samples = 1024;
  }
}

proto::TileRange TilePlan::tiles(int z) const {
  if (z == 0) return {0, 0, 1, 0};
  const double side = tiling::tile_degrees(z);
  auto index = [&](double degrees, std::uint32_t count, bool upper) {
    const double t = degrees / side;
    // A tile that only touches the bounds from outside holds nothing but an edge.
    const double i = upper ? std::ceil(t) - 1 : std::floor(t);
    return std::uint32_t(std::clamp(i, 0.0, double(count - 1)));
  };
  const std::uint32_t columns = tiling::columns(z), rows = tiling::rows(z);
  proto::TileRange r{
      index(bounds_.west + 180, columns, false), index(bounds_.south + 90, rows, false),
      index(bounds_.east + 180, columns, true), index(bounds_.north + 90, rows, true)};
  r.end_x = std::max(r.end_x, r.start_x);
  r.end_y = std::max(r.end_y, r.start_y);
  return r;
}

bool TilePlan::available(TileId t) const {
  if (t.level < min_level_ || t.level > max_level_) return false;
  const proto::TileRange r = tiles(t.level);
  return t.x >= r.start_x && t.x <= r.end_x && t.y >= r.start_y && t.y <= r.end_y;
}

std::uint64_t TilePlan::tile_count() const {
  std::uint64_t n = 0;
  for (int z = min_level_; z <= max_level_; ++z) {
    const proto::TileRange r = tiles(z);
    n += std::uint64_t(r.end_x - r.start_x + 1) * (r.end_y - r.start_y + 1);
  }
  return n;
}

proto::LayerJson TilePlan::layer(const std::string& name) const {
  proto::LayerJson layer;
  layer.name = name;
  layer.bounds = {bounds_.west, bounds_.south, bounds_.east, bounds_.north};
  layer.minzoom = min_level_;
  layer.maxzoom = max_level_;
  for (int z = 0; z <= max_level_; ++z) {
    if (z < min_level_)
      layer.available.emplace_back();
    else
      layer.available.push_back({tiles(z)});
  }
  layer.extensions = {"octvertexnormals", "metadata"};
  layer.metadata_availability = kAvailabilityLevels;
  layer.side = options_.side;
  return layer;
}

std::vector<std::vector<proto::TileRange>> TilePlan::descendants(TileId t) const {
  std::vector<std::vector<proto::TileRange>> levels;
  if (t.level % kAvailabilityLevels != 0) return levels;
  for (int down = 1; down <= kAvailabilityLevels && t.level + down <= max_level_; ++down) {
    proto::TileRange r = tiles(t.level + down);
    r.start_x = std::max(r.start_x, t.x << down);
    r.start_y = std::max(r.start_y, t.y << down);
    r.end_x = std::min(r.end_x, ((t.x + 1) << down) - 1);
    r.end_y = std::min(r.end_y, ((t.y + 1) << down) - 1);
    const bool none = r.start_x > r.end_x || r.start_y > r.end_y || t.level + down < min_level_;
    levels.push_back(none ? std::vector<proto::TileRange>{} : std::vector{r});
  }
  return levels;
}

}  // namespace tind
