#include "terrain/pyramid/plan/level_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <tuple>

#include "terrain/base/parallel.h"
#include "terrain/base/power_of_two.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/plan/height_steps.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/on_globe.h"
#include "terrain/surface/stated_accuracy.h"
#include "terrain/surface/surface_blocks.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/tile/largest_error.h"
#include "terrain/tile/tile_lines.h"

namespace tind {

namespace {

constexpr int kTileCells = 64;  // the leaf level's grid is at least as fine as the source
constexpr double kBorderShare = 0.85, kCoarseBorderShare = 0.5;  // of the error that a fit may have
constexpr double kSlack_m = 4;  // of a level's heights, for what steps round

int leaf_level(const DemInfo& info) {
  const double lat = (info.bounds.south + info.bounds.north) / 2;
  const Vec2 degree = wgs84::metres_per_degree(std::clamp(lat, -80.0, 80.0));
  // Of a geographic DEM near a pole the steps in degrees count, not how narrow they are there.
  const double across = std::abs(lat) > 80 && info.period_cols > 0 ? 360 / info.period_cols
                                                                   : info.spacing_x_m / degree.x;
  const double spacing = std::min(across, info.spacing_y_m / degree.y);
  for (int z = 0; z < tiling::kMaxLevel; ++z)
    if (tiling::tile_degrees(z) / kTileCells <= spacing * (1 + 1e-6)) return z;
  return tiling::kMaxLevel;
}

TileArea area_of(const Surface& surface, std::size_t layer, int level) {
  if (level == 0) return TileArea({{0, 0, 1, 0}});
  std::vector<TileRange> ranges;
  for (const GeoRect& r : surface.area(layer)) ranges.push_back(tiles_over(r, level));
  return TileArea(std::move(ranges));
}

/// Posts of the files; where they overlap, of each.
double posts_of(const DemInfo& info) {
  double posts = 0;
  for (const PostRect& r : info.covered)
    posts += double(r.last_col - r.col + 1) * double(r.last_row - r.row + 1);
  return posts;
}

std::vector<proto::TileRange> on_the_wire(std::span<const TileRange> ranges) {
  std::vector<proto::TileRange> out;
  for (const TileRange& r : ranges) out.push_back({r.west, r.south, r.east, r.north});
  return out;
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

int place_step(double spacing_m, int level, double eps) {
  const double degrees = std::min(spacing_m / 4, eps) / 111320;
  const double units = degrees / tiling::tile_degrees(level) * 32767;
  return int(std::clamp(power_of_two_at_most(std::max(units, 1.0)), 1.0, 64.0));
}

namespace {

bool touches_a_file(const DemInfo& info, std::int64_t col, std::int64_t row, int cols, int rows) {
  return info.covered.empty() || std::ranges::any_of(info.covered, [&](const PostRect& r) {
           return r.col < col + cols && r.last_col >= col && r.row < row + rows &&
                  r.last_row >= row;
         });
}

/// The post of this height in a piece of the source.
PostPlace place_in(const HeightGrid& piece, std::int64_t col, std::int64_t row, double height_m) {
  const auto values = piece.values();
  const auto at = std::ranges::find(values, float(height_m)) - values.begin();
  return {col + at % piece.cols(), row + at / piece.cols()};
}

/// The range of all pieces, and in which of them its ends are: of several in the first one, so that
/// it does not depend on the number of threads.
class RangeOfPieces {
 public:
  void take(std::size_t i, const HeightRange& part, const HeightGrid& piece, std::int64_t col,
            std::int64_t row) {
    range_.valid += part.valid;
    if (part.valid == 0) return;
    if (part.min_m < range_.min_m || (part.min_m == range_.min_m && i < lowest_in_)) {
      range_.min_m = part.min_m, lowest_in_ = i;
      range_.lowest = place_in(piece, col, row, part.min_m);
    }
    if (part.max_m > range_.max_m || (part.max_m == range_.max_m && i < highest_in_)) {
      range_.max_m = part.max_m, highest_in_ = i;
      range_.highest = place_in(piece, col, row, part.max_m);
    }
  }
  const HeightRange& range() const { return range_; }

 private:
  HeightRange range_{HUGE_VAL, -HUGE_VAL, 0};
  std::size_t lowest_in_ = 0, highest_in_ = 0;
};

}  // namespace

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
  RangeOfPieces all;
  std::optional<std::pair<std::size_t, Error>> first_error;
  std::size_t done = 0;
  std::mutex mutex;
  parallel_for(std::size_t(across * down), threads, [&](std::size_t i) {
    if (progress.stopped()) return;
    const std::int64_t row = std::int64_t(i) / across * kRows,
                       col = std::int64_t(i) % across * kCols;
    const int cols = int(std::min(kCols, info.cols - col)),
              rows = int(std::min(kRows, info.rows - row));
    if (!touches_a_file(info, col, row, cols, rows)) {
      if (blocks) blocks->add_void(col, row, cols, rows);
      return;
    }
    const auto grid = source.read(col, row, cols, rows);
    HeightRange part{HUGE_VAL, -HUGE_VAL, 0};
    if (grid) {
      if (blocks) blocks->add(col, row, *grid);
      part.add(grid->values());
    }
    const std::lock_guard lock(mutex);
    if (!grid && (!first_error || i < first_error->first)) first_error.emplace(i, grid.error());
    if (grid) all.take(i, part, *grid, col, row);
    if (++done % std::max<std::int64_t>(1, across * down / 200) == 0)
      progress.at(double(done) / double(across * down));
  });
  if (first_error) return std::unexpected(first_error->second);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped while reading heights");
  return all.range();
}

namespace {

/// Takes in a layer's.
void add_layer(HeightRange& all, HeightRange part, std::size_t layer) {
  if (part.lowest) part.lowest->layer = layer;
  if (part.highest) part.highest->layer = layer;
  all.valid += part.valid;
  if (part.min_m < all.min_m) all.min_m = part.min_m, all.lowest = part.lowest;
  if (part.max_m > all.max_m) all.max_m = part.max_m, all.highest = part.highest;
}

}  // namespace

std::string no_valid_height(const DemInfo& info) {
  return info.files.front() + (info.files.size() > 1 ? " and the others have" : " has") +
         " no valid height: every post is void (its nodata value, or not a number)";
}

Result<HeightRange> scan_heights(const Surface& surface, const Progress& progress, int threads,
                                 SurfaceBlocks* blocks) {
  const auto layers = surface.layers();
  Result<HeightRange> range = HeightRange{HUGE_VAL, -HUGE_VAL, 0};
  double done = 0;
  for (std::size_t k = 0; k < layers.size() && range; ++k) {
    const DemInfo& info = layers[k].source->info();
    const double share = double(info.cols) * double(info.rows) / double(surface.post_count());
    auto part = read_height_range(*layers[k].source, progress.part(done, done + share), threads,
                                  blocks ? &blocks->layers()[k] : nullptr);
    done += share;
    if (!part) return part;
    if (layers.size() == 1) {
      range = part;
      break;
    }
    add_layer(*range, *part, k);
  }
  if (range && range->valid == 0) return fail(Errc::bad_data, no_valid_height(surface.info()));
  return range;
}

namespace {

/// The levels that have tiles below the end of the coarsest layer: as few areas as there are ends.
struct Group {
  int first = 0, last = 0;
};
std::vector<Group> groups_below(const TilePlan& plan, std::size_t layers) {
  std::vector<int> ends;
  ends.reserve(layers);
  for (std::size_t k = 0; k < layers; ++k) ends.push_back(plan.deepest_of(k));
  std::ranges::sort(ends);
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::vector<Group> groups;
  for (std::size_t i = 1; i < ends.size(); ++i) groups.push_back({ends[i - 1] + 1, ends[i]});
  return groups;
}

/// Of the posts of a window, a part at a time.
Result<void> add_window(const DemSource& source, const PostWindow& w, HeightRange& range) {
  constexpr std::int64_t kRows = 256, kCols = 4096;
  for (std::int64_t r = 0; r < w.rows; r += kRows)
    for (std::int64_t c = 0; c < w.cols; c += kCols) {
      const auto grid = source.read(w.col + c, w.row + r, int(std::min(kCols, w.cols - c)),
                                    int(std::min(kRows, w.rows - r)));
      if (!grid) return std::unexpected(grid.error());
      range.add(grid->values());
    }
  return {};
}

/// The posts' bounds; around a single row or column of posts half a spacing more, because clients
/// fly to an area.
GeoRect bounds_with_area(const DemInfo& info) {
  constexpr double kDegree_m = 111320;
  GeoRect b = info.bounds;
  if (!(b.north > b.south)) {
    const double half = info.spacing_y_m / kDegree_m / 2;
    b.south = std::max(b.south - half, -90.0), b.north = std::min(b.north + half, 90.0);
  }
  if (!(b.east > b.west)) {
    const double shrunk = std::max(0.01, std::cos(b.south * std::numbers::pi / 180));
    const double half = info.spacing_x_m / kDegree_m / shrunk / 2;
    b.west = std::max(b.west - half, -180.0), b.east = std::min(b.east + half, 180.0);
  }
  return b;
}

}  // namespace

Result<void> find_level_ranges(const Surface& surface, const TilePlan& outline,
                               HeightRange& range) {
  const auto layers = surface.layers();
  if (layers.size() == 1) return {};
  range.of_levels.assign(std::size_t(outline.max_level()) + 1, {range.min_m, range.max_m});
  for (const Group& group : groups_below(outline, layers.size())) {
    HeightRange part{HUGE_VAL, -HUGE_VAL, 0};
    for (const TileRange& r : outline.tiles(group.first).ranges()) {
      const double side = tiling::tile_degrees(group.first);
      const GeoRect rect{r.west * side - 180, r.south * side - 90, (r.east + 1) * side - 180,
                         (r.north + 1) * side - 90};
      for (const SurfaceLayer& layer : layers)
        for (const PostWindow& posts : post_windows(*layer.source, rect))
          if (auto done = add_window(*layer.source, posts, part); !done) return done;
    }
    if (part.valid == 0) continue;
    for (int z = group.first; z <= group.last; ++z)
      range.of_levels[std::size_t(z)] = {part.min_m, part.max_m};
  }
  return {};
}

Result<TilePlan> TilePlan::make(const Surface& surface, const HeightRange& range,
                                const TileSetOptions& options) {
  const DemInfo& info = surface.info();
  if (const auto ok = check_on_globe(info); !ok) return std::unexpected(ok.error());
  if (!(options.error_factor > 0) || !(options.max_error_m >= 0))
    return fail(Errc::invalid_argument, "error bounds must be positive numbers of metres");
  if (const auto ok = check_tile_method(options.method); !ok) return std::unexpected(ok.error());
  if (const auto ok = check_tile_colours(options, info.bounds); !ok)
    return std::unexpected(ok.error());
  const SurfaceShapes* shapes = surface.shapes();
  if (shapes && !shapes->lines().empty() && options.side != Side::both)
    return fail(Errc::invalid_argument,
                "lines have one height: with them --side is both, neither above nor below");
  TilePlan plan;
  plan.options_ = options;
  if (shapes) {
    plan.shapes_ = shapes->digest();
    plan.levels_of_shapes_ = shapes->level_digest();
    plan.water_mask_ = !shapes->water().empty();
  }
  plan.range_ = range;
  plan.bounds_ = bounds_with_area(info);
  plan.datum_ = info.datum;
  plan.accuracy_ = stated_accuracy(surface);
  plan.settle_ends(surface);
  plan.first_level_ = options.first_level;
  plan.last_level_ =
      options.last_level < 0 ? plan.max_level_ : std::min(options.last_level, plan.max_level_);
  if (plan.max_level_ > tiling::kMaxLevel || plan.first_level_ < 0 ||
      (options.last_level >= 0 && options.last_level < plan.first_level_)) {
    return fail(Errc::invalid_argument,
                "levels must lie in 0-" + std::to_string(tiling::kMaxLevel) + ", lower end first");
  }
  if (plan.first_level_ > plan.max_level_) {
    return fail(Errc::invalid_argument,
                "the pyramid of " + info.files.front() + " ends at level " +
                    std::to_string(plan.max_level_) + ": there is no level " +
                    std::to_string(plan.first_level_) + " (--deepest makes it end elsewhere)");
  }
  plan.settle_areas(surface);
  plan.local_steps_ = surface.only() && !shapes;
  if (plan.local_steps_ && range.valid > 0)
    if (auto ok = check_heights(info, range.min_m, range.max_m); !ok)
      return std::unexpected(ok.error());
  plan.memo_ = std::make_shared<StepMemo>();
  for (int z = 0; z <= plan.max_level_; ++z) plan.levels_.push_back(plan.kinds_of(surface, z));
  const IndexDepth depth = IndexDepth::of(surface, options.exact_posts);
  // The level below the deepest has borders that leave room for the index, too.
  if (options.side == Side::both && depth.level() >= plan.first_level_) plan.depth_ = depth;
  plan.most_posts_level_ = depth.level() - 1;
  plan.leave_room();
  return plan;
}

/// Where each layer ends, and how exact it is there.
void TilePlan::settle_ends(const Surface& surface) {
  const auto layers = surface.layers();
  std::vector<double> bounds;
  for (const SurfaceLayer& layer : layers) {
    const DemInfo& info = layer.source->info();
    leaves_.push_back(leaf_level(info));
    const double spacing = layers.size() == 1 ? std::sqrt(layer.spacing_m.x * layer.spacing_m.y)
                                              : rank_spacing_m(info);
    const double asked = layer.max_error_m > 0 ? layer.max_error_m : options_.max_error_m;
    bounds.push_back(asked > 0 ? asked : spacing / 32);
  }
  max_level_ = std::ranges::max(leaves_);
  if (options_.max_level >= 0)
    for (int& leaf : leaves_)
      leaf = leaf == max_level_ ? options_.max_level : std::min(leaf, options_.max_level);
  if (options_.max_level >= 0) max_level_ = options_.max_level;
  ends_m_ = bounds;
  std::ranges::sort(ends_m_);
  ends_m_.erase(std::unique(ends_m_.begin(), ends_m_.end()), ends_m_.end());
  for (const double bound : bounds)
    bound_of_.push_back(std::size_t(std::ranges::find(ends_m_, bound) - ends_m_.begin()));
}

void TilePlan::settle_areas(const Surface& surface) {
  const auto layers = surface.layers();
  if (layers.size() > 1) {
    for (std::size_t k = 0; k < layers.size(); ++k) {
      auto& areas = layer_areas_.emplace_back();  // one level more: the parts of the last tiles
      for (int z = 0; z <= std::min(max_level_ + 1, tiling::kMaxLevel); ++z)
        areas.push_back(area_of(surface, k, z));
    }
  }
  for (int z = 0; z <= max_level_; ++z) {
    std::vector<TileRange> ranges;
    for (std::size_t k = 0; k < layers.size(); ++k) {
      if (leaves_[k] < z) continue;
      const TileArea area = area_of(surface, k, z);
      ranges.insert(ranges.end(), area.ranges().begin(), area.ranges().end());
    }
    areas_.emplace_back(std::move(ranges));
  }
}

/// Which of its level's plans a tile has: of the parts that end here, the strictest bound.
std::size_t TilePlan::kind_of(TileId t) const {
  if (layer_areas_.empty()) return t.level == max_level_ ? 1 : 0;
  std::size_t kind = 0;
  for (int part = 0; part < 4; ++part) {
    const TileId child = t.child(part % 2, part / 2);
    if (available(child)) continue;
    for (std::size_t k = 0; k < layer_areas_.size(); ++k) {
      const auto& areas = layer_areas_[k];
      const bool there = std::size_t(child.level) < areas.size() &&
                         areas[std::size_t(child.level)].contains(child.x, child.y);
      if (there && (kind == 0 || bound_of_[k] + 1 < kind)) kind = bound_of_[k] + 1;
    }
  }
  // (A layer too small for a tile of the next level ends here, too.)
  return kind == 0 && t.level == max_level_ ? 1 : kind;
}

/// Of the layers that are the reason for tiles below along a side, the strictest bound, as a kind;
/// 0: there is no tile.
std::size_t TilePlan::kind_below(TileId t, TileSide side) const {
  std::size_t kind = 0;
  for (const int half : {0, 1}) {
    const bool upright = side == TileSide::west || side == TileSide::east;
    const TileId child =
        upright ? t.child(side == TileSide::east, half) : t.child(half, side == TileSide::north);
    if (t.level >= max_level_ || !available(child)) continue;
    for (std::size_t k = 0; k < layer_areas_.size(); ++k)
      if (leaves_[k] >= child.level &&
          layer_areas_[k][std::size_t(child.level)].contains(child.x, child.y) &&
          (kind == 0 || bound_of_[k] + 1 < kind))
        kind = bound_of_[k] + 1;
  }
  return kind;
}

const LevelPlan& TilePlan::level(TileId t, TileSide side) const {
  const LevelPlan& own = level(t);
  if (layer_areas_.empty()) return own;
  const std::uint32_t columns = tiling::columns(t.level), rows = tiling::rows(t.level);
  TileId other = t;
  TileSide facing = TileSide::south;
  if (side == TileSide::west) other.x = (t.x + columns - 1) % columns, facing = TileSide::east;
  if (side == TileSide::east) other.x = (t.x + 1) % columns, facing = TileSide::west;
  if (side == TileSide::south && t.y > 0) --other.y, facing = TileSide::north;
  if (side == TileSide::north && t.y + 1 < rows) ++other.y;
  if (other == t) return own;
  const LevelPlan* strictest = &own;
  const auto take = [&](const LevelPlan& plan) {
    if (plan.fit_error_m < strictest->fit_error_m) strictest = &plan;
  };
  if (available(other)) take(level(other));
  // Where tiles go on below on one side only, clients draw those beside this one.
  const std::size_t here = kind_below(t, side), there = kind_below(other, facing);
  if ((here == 0) != (there == 0)) take(levels_[std::size_t(t.level)][std::max(here, there)]);
  return *strictest;
}

/// Of layers: that of the finest which ends at this level or the next, 0 where none does. So a
/// level does not depend on what finer layers there are below it.
Vec2 TilePlan::spacing_at(const Surface& surface, int z) const {
  double spacing = HUGE_VAL;
  for (std::size_t k = 0; k < leaves_.size(); ++k)
    if (leaves_[k] == z || leaves_[k] == z + 1)
      spacing = std::min(spacing, rank_spacing_m(surface.layers()[k].source->info()));
  return spacing == HUGE_VAL ? Vec2{0, 0} : Vec2{spacing, spacing};
}

/// A level's plans: [0] of tiles that go on, then one for each bound.
std::vector<LevelPlan> TilePlan::kinds_of(const Surface& surface, int z) const {
  const bool one = surface.only() != nullptr;
  const Vec2 posts = one ? surface.layers()[0].spacing_m : spacing_at(surface, z);
  const double spacing = std::sqrt(posts.x * posts.y);
  const double latitude_degree = 111320;
  double low = range_.min_m, high = range_.max_m;
  if (std::size_t(z) < range_.of_levels.size())
    std::tie(low, high) = range_.of_levels[std::size_t(z)];
  if (const SurfaceShapes* shapes = surface.shapes())  // also of water in which no post lies
    for (std::uint32_t p = 0; p < shapes->level_areas().polygons(); ++p)
      low = std::min(low, shapes->level_of(p)), high = std::max(high, shapes->level_of(p));
  std::vector<LevelPlan> kinds(ends_m_.size() + 1);
  double strictest = HUGE_VAL;  // of those that this level can have
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    LevelPlan& level = kinds[i];
    level.budget_m = tiling::level_error(z) * options_.error_factor;
    if (i > 0) level.budget_m = std::min(level.budget_m, ends_m_[i - 1]);
    level.fit_error_m = std::min(level.budget_m, kLargestError_m);
    bool can_be = i == 0 || one;
    for (std::size_t k = 0; k < leaves_.size() && !can_be; ++k)
      can_be = leaves_[k] <= z && bound_of_[k] + 1 == i;
    if (can_be && (!one || (i == 1) == (z == max_level_)))
      strictest = std::min(strictest, level.fit_error_m);
  }
  const double widest = kinds[0].fit_error_m;
  for (LevelPlan& level : kinds) {
    if (options_.side != Side::both) {
      // A corner has one height, whichever of its tiles asks: all of a level lie as far off.
      level.fit_error_m = (one ? level.fit_error_m : strictest) / 2;
      level.offset_m = options_.side == Side::above ? level.fit_error_m : -level.fit_error_m;
    }
    const double fit = one ? level.fit_error_m
                           : strictest / (options_.side != Side::both ? 2 : 1);  // so has its step
    // Heights of a tile: posts, 0 where there are none, and half a band beyond either.
    const double beyond =
        2 * ((one ? level.fit_error_m : widest) + std::abs(level.offset_m)) + kSlack_m;
    const double relief = std::max(high, 0.0) - std::min(low, 0.0) + beyond;
    const double farthest = std::max(std::abs(low), std::abs(high)) + beyond;
    level.border_step_m = local_steps_ ? height_step(level, 0, 0) : step_for(fit, relief, farthest);
    level.border_tolerance_m = kBorderShare * level.fit_error_m;
    level.curvature_cells = tind::curvature_cells(z);
    level.line_tolerance = line_tolerance(z, level.budget_m);
    level.normal_reach_deg = std::max(spacing / latitude_degree, tiling::tile_degrees(z) / 128);
    double places = std::min(posts.x, posts.y);
    if (!one) {
      places = std::max(places, tiling::tile_degrees(z) * latitude_degree / 128);
      // What bends a layer can overshoot the posts by as much as two layers can differ.
      const double least = std::min(low, 0.0), most = std::max(high, 0.0);
      level.lowest_m = least - (most - least), level.highest_m = most + (most - least);
    }
    level.border_place_step = place_step(places, z, level.fit_error_m);
  }
  return kinds;
}

void TilePlan::leave_room() {
  for (int z = 0; z <= std::min(max_level_, depth_.level()); ++z) {
    for (LevelPlan& level : levels_[std::size_t(z)]) {
      // What lies between nodes or skipped posts comes on top of a mesh's error, beside its border
      // too, where nothing can be done about it.
      level.border_tolerance_m = kCoarseBorderShare * level.fit_error_m;
      // Tiles of millions of posts have thousands along a border. The coarser ones need not be
      // looked at so closely: their budgets are larger than what lies between samples.
      if (z >= depth_.coarsest_level() - 3) level.border_samples = 1024;
    }
  }
}

bool TilePlan::has_step_of_all(TileId t) const {
  return t.level <= most_posts_level_ || t.y == 0 || t.y + 1 == tiling::rows(t.level);
}

double TilePlan::step_of_all(int z) const {
  return height_step(level(z), std::min(range_.min_m, 0.0), std::max(range_.max_m, 0.0));
}

bool TilePlan::rests_on_all_heights(TileId t) const {
  return !local_steps_ || has_step_of_all(t) || t.y <= 1 || t.y + 2 >= tiling::rows(t.level);
}

bool TilePlan::available(TileId t) const {
  return t.level >= 0 && t.level <= max_level_ && tiles(t.level).contains(t.x, t.y);
}

bool TilePlan::wanted(TileId t) const {
  return t.level >= first_level_ && t.level <= last_level_ && available(t);
}

std::uint64_t TilePlan::tile_count() const {
  std::uint64_t n = 0;
  for (int z = first_level_; z <= last_level_; ++z) n += tiles(z).size();
  return n;
}

std::string TilePlan::warning(const Surface& surface) const {
  const DemInfo& info = surface.info();
  constexpr std::uint64_t kMany = 10'000;
  constexpr double kPostsOfATile = 64, kFar = 0.01;
  constexpr double kFinest = 0.01;  // metres: 1e-7 degrees
  if (surface.only() && info.covered.empty()) return {};
  // Near a pole columns of degrees are close and tiles are not finer for it.
  const bool near_pole = std::max(info.bounds.north, -info.bounds.south) > 80;
  const double finest = near_pole ? info.spacing_y_m : std::min(info.spacing_x_m, info.spacing_y_m);
  if (finest < kFinest)
    return "posts less than 1 cm apart are too fine for tiles in degrees: stated errors may be too "
           "small by micrometres, or far too large; resample it to 1 cm or coarser";
  if (max_level_ <= last_level_ && options_.max_error_m > level(max_level_).budget_m)
    return fmt::format(
        "the largest error asked for, {:g} m, changes nothing: level {} keeps {:g} m; --deepest or "
        "--error-factor makes coarser tiles",
        options_.max_error_m, max_level_, level(max_level_).budget_m);
  const std::uint64_t tiles = tile_count();
  double posts = 0;
  for (const SurfaceLayer& layer : surface.layers()) posts += posts_of(layer.source->info());
  const std::string levels =
      "levels " + std::to_string(first_level_) + "-" + std::to_string(last_level_);
  const std::string of = std::to_string(tiles) + " tiles of " + levels;
  if (tiles > kMany && posts < kPostsOfATile * double(tiles))
    return of + " for " + std::to_string(std::int64_t(posts)) +
           " posts: --levels or --deepest makes fewer";
  if (surface.only() && info.files.size() > 1 &&
      posts < kFar * double(info.cols) * double(info.rows))
    return "the " + std::to_string(info.files.size()) +
           " files lie far apart (they fill less than 1 % of the rectangle around them): " + of;
  return {};
}

proto::LayerJson TilePlan::layer(const std::string& name) const {
  proto::LayerJson layer;
  layer.name = name;
  layer.bounds = {bounds_.west, bounds_.south, bounds_.east, bounds_.north};
  layer.minzoom = first_level_;
  layer.maxzoom = last_level_;
  for (int z = 0; z <= last_level_; ++z) {
    if (z < first_level_)
      layer.available.emplace_back();
    else
      layer.available.push_back(on_the_wire(tiles(z).ranges()));
  }
  layer.extensions = {"octvertexnormals", "metadata"};
  if (water_mask_) layer.extensions.insert(layer.extensions.begin() + 1, "watermask");
  layer.metadata_availability = kAvailabilityLevels;
  layer.side = name_of(options_.side);
  layer.datum = tind::name(datum_);
  layer.accuracy = accuracy_;
  return layer;
}

std::vector<std::vector<proto::TileRange>> TilePlan::descendants(TileId t) const {
  std::vector<std::vector<proto::TileRange>> levels;
  if (t.level % kAvailabilityLevels != 0) return levels;
  for (int down = 1; down <= kAvailabilityLevels && t.level + down <= max_level_; ++down) {
    const TileRange below{t.x << down, t.y << down, ((t.x + 1) << down) - 1,
                          ((t.y + 1) << down) - 1};
    levels.push_back(on_the_wire(tiles(t.level + down).within(below)));
  }
  return levels;
}

}  // namespace tind
