// Block by block over the source: a post belongs to one tile of each level, to two on an edge, to
// four on a corner. On an edge between triangles it is measured in every triangle that holds it.

#include "terrain/check/check_source.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>

#include "terrain/base/lru.h"
#include "terrain/base/parallel.h"
#include "terrain/check/check_decode.h"
#include "terrain/check/check_surface.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/height_field.h"

namespace tind {

namespace {

constexpr int kBlock = 256;  // posts a side
constexpr std::size_t kCacheBytes = 256u << 20;
constexpr double kEnd = 32767;

using Mesh = std::shared_ptr<const TileSurface>;  // null: cannot be decoded

/// Decoded tiles, the least recently used ones forgotten.
class SurfaceCache {
 public:
  explicit SurfaceCache(const TileListing& listing) : listing_(listing) {}
  bool unread() const { return unread_; }

  Mesh get(TileId id) {
    {
      const std::lock_guard lock(mutex_);
      if (const Mesh* known = surfaces_.find(id)) return *known;
    }
    Mesh surface = load(id);
    const std::lock_guard lock(mutex_);
    surfaces_.insert(id, surface, surface ? surface->bytes() : 100);
    return surface;
  }

 private:
  Mesh load(TileId id) const {
    Findings ignored;  // reported elsewhere
    std::vector<std::uint8_t> bytes;
    CheckedTile tile;
    if (!read_tile_file(listing_, id, bytes, ignored)) {
      if (ignored.total(Severity::unread) > 0) unread_ = true;
      return nullptr;
    }
    if (!check_decode(bytes, "", tile, ignored)) return nullptr;
    for (const auto& triangle : tile.triangles)
      for (const std::uint32_t i : triangle)
        if (i >= tile.u.size()) return nullptr;
    return std::make_shared<TileSurface>(tile);
  }

  mutable std::atomic<bool> unread_ = false;
  const TileListing& listing_;
  std::mutex mutex_;
  Lru<TileId, Mesh> surfaces_{kCacheBytes, 1};
};

// ---- posts ----

void merge(MeasuredTile& into, const MeasuredTile& from) {
  if (from.posts == 0) return;
  const bool first = into.posts == 0;
  const bool larger = from.max_error_m > into.max_error_m;
  const bool earlier =
      from.max_error_m == into.max_error_m &&
      std::tuple(from.layer, from.row, from.col) < std::tuple(into.layer, into.row, into.col);
  if (first || larger || earlier) {
    into.max_error_m = from.max_error_m;
    into.col = from.col;
    into.row = from.row;
    into.layer = from.layer;
  }
  into.low_m = first ? from.low_m : std::min(into.low_m, from.low_m);
  into.high_m = first ? from.high_m : std::max(into.high_m, from.high_m);
  into.above_m = first ? from.above_m : std::max(into.above_m, from.above_m);
  into.below_m = first ? from.below_m : std::max(into.below_m, from.below_m);
  for (const auto& [level, range] : from.flat) {
    const auto [there, is_new] = into.flat.try_emplace(level, range);
    if (is_new) continue;
    there->second.low = std::min(there->second.low, range.low);
    there->second.high = std::max(there->second.high, range.high);
  }
  into.posts += from.posts;
  into.uncovered += from.uncovered;
}

struct Post {
  double lon, lat, height;
  std::int64_t col, row;
  std::size_t layer;
  std::optional<double> level = {};  // of the polygon that it lies in
};

/// Does a place lie so far inside its polygon that a level has to show it level? Lines may be
/// thinned by 128 units of the tile's grid, and what is smaller than four times that is no line.
bool well_inside(const AreaSet& areas, const Post& p, int level) {
  const double reach = tiling::tile_degrees(level) * 4 * 128 / kEnd;
  const double wide = reach / std::max(0.01, std::cos(p.lat * 0.017453292519943295));
  return !areas.crosses({p.lon - wide, p.lat - reach, p.lon + wide, p.lat + reach});
}

/// Measures the posts of one block in the tiles of one level.
class LevelMeasure {
 public:
  LevelMeasure(int level, const TileListing& listing, SurfaceCache& cache,
               const SurfaceShapes* shapes)
      : level_(level),
        side_(tiling::tile_degrees(level)),
        listing_(listing),
        cache_(cache),
        shapes_(shapes) {}

  /// The tiles whose closed rectangle holds the post: one, two on an edge, four on a corner. Is
  /// there any?
  bool post(const Post& p) {
    bool held = false;
    const double x = (p.lon + 180) / side_, y = (p.lat + 90) / side_;
    const auto columns = std::int64_t(tiling::columns(level_));
    flat_ = p.level && well_inside(shapes_->level_areas(), p, level_);
    const auto tx = std::int64_t(std::floor(x)), ty = std::int64_t(std::floor(y));
    for (std::int64_t dy = 0; dy <= (y == double(ty) ? 1 : 0); ++dy)
      for (std::int64_t dx = 0; dx <= (x == double(tx) ? 1 : 0); ++dx) {
        const std::int64_t column = (tx - dx + columns) % columns;  // 180 is -180
        held |= in_tile(column, ty - dy, dx ? kEnd : (x - double(tx)) * kEnd,
                        dy ? kEnd : (y - double(ty)) * kEnd, p);
      }
    return held;
  }

  const std::map<std::int64_t, MeasuredTile>& measured() const { return measured_; }

 private:
  struct Entry {
    Mesh surface;
    MeasuredTile* result = nullptr;
  };

  bool in_tile(std::int64_t x, std::int64_t y, double u, double v, const Post& p) {
    const auto id = tiling::tile(level_, x, y);
    if (!id) return false;
    if (!last_ || *last_ != *id) {
      entry_ = find(*id);
      last_ = id;
    }
    if (!entry_.result) return false;
    const auto gap = entry_.surface->gap_at(u, v, p.height);
    MeasuredTile one;
    one.layer = p.layer, one.col = p.col, one.row = p.row;
    one.posts = 1, one.uncovered = gap ? 0 : 1;
    if (gap) {
      one.max_error_m = std::abs(gap->worst());
      one.above_m = gap->high;
      one.below_m = -gap->low;
      if (flat_) one.flat[*p.level] = {gap->low, gap->high};
    }
    one.low_m = one.high_m = p.height;
    merge(*entry_.result, one);
    return true;
  }

  Entry find(TileId id) {
    const auto it = entries_.find(id);
    if (it != entries_.end()) return it->second;
    Entry entry;
    const std::int64_t place = listing_.find(id);
    if (place >= 0) entry.surface = cache_.get(id);
    if (entry.surface) entry.result = &measured_[place];
    entries_[id] = entry;
    return entry;
  }

  const int level_;
  const double side_;
  const TileListing& listing_;
  SurfaceCache& cache_;
  const SurfaceShapes* shapes_;
  bool flat_ = false;  // the post at hand has to be level
  std::map<TileId, Entry> entries_;
  std::map<std::int64_t, MeasuredTile> measured_;
  std::optional<TileId> last_;
  Entry entry_;
};

/// A square of a layer's posts.
struct LayerBlock {
  std::size_t layer;
  PostRect posts;
};

/// The blocks in which there is a file. (Between files that lie far apart there can be millions.)
std::vector<LayerBlock> blocks_of(const Surface& surface) {
  std::vector<LayerBlock> blocks;
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    const DemInfo& info = surface.layers()[k].source->info();
    for (std::int64_t row = 0; row < info.rows; row += kBlock)
      for (std::int64_t col = 0; col < info.cols; col += kBlock) {
        const PostRect block{col, row, std::min(col + kBlock, info.cols) - 1,
                             std::min(row + kBlock, info.rows) - 1};
        const auto meets = [&](const PostRect& part) {
          return part.col <= block.last_col && block.col <= part.last_col &&
                 part.row <= block.last_row && block.row <= part.last_row;
        };
        if (info.covered.empty() || std::ranges::any_of(info.covered, meets))
          blocks.push_back({k, block});
      }
  }
  return blocks;
}

/// Of one DEM its posts. Of layers those that no higher one replaces, bent where one ends nearby:
/// which posts those are, and how high, is what H says (surface/height_field.h). So of layers this
/// checks the tiles, not H; scripts/oracle has an H of its own.
Result<void> settle_heights(const Surface& surface, std::size_t layer,
                            const std::vector<Geographic>& places, std::vector<Post>& posts) {
  if (surface.only()) return {};
  std::vector<double> heights(posts.size());
  for (std::size_t i = 0; i < posts.size(); ++i) heights[i] = posts[i].height;
  const HeightField field(surface);
  field.raise(layer, places, heights);
  if (const auto error = field.error()) return std::unexpected(*error);
  for (std::size_t i = 0; i < posts.size(); ++i) posts[i].height = heights[i];
  std::erase_if(posts, [](const Post& p) { return std::isnan(p.height); });
  return {};
}

Result<std::vector<Post>> read_posts(const Surface& surface, const LayerBlock& part) {
  const DemSource& source = *surface.layers()[part.layer].source;
  const SurfaceShapes* const shapes = surface.shapes();
  const PostRect& block = part.posts;
  const std::int64_t col = block.col, row = block.row;
  const int cols = int(block.last_col - col + 1), rows = int(block.last_row - row + 1);
  const auto heights = source.read(col, row, cols, rows);
  if (!heights) return std::unexpected(heights.error());
  std::vector<Post> posts;
  std::vector<Vec2> at;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c) {
      if (heights->is_void(c, r)) continue;
      posts.push_back({0, 0, double(heights->at(c, r)), col + c, row + r, part.layer});
      at.push_back({double(col + c), double(row + r)});
    }
  std::vector<Geographic> places(at.size());
  source.to_geographic(at, places);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    posts[i].lon = places[i].lon;
    posts[i].lat = places[i].lat;
    while (posts[i].lon > 180) posts[i].lon -= 360;
    while (posts[i].lon < -180) posts[i].lon += 360;
    if (shapes) posts[i].level = shapes->level_at({posts[i].lon, posts[i].lat});
  }
  if (auto done = settle_heights(surface, part.layer, places, posts); !done)
    return std::unexpected(done.error());
  return posts;
}

}  // namespace

Result<MeasuredTiles> measure_against_source(const TileListing& listing, const Surface& surface,
                                             int threads, const Progress& progress) {
  MeasuredTiles measured;
  const std::size_t levels = listing.levels.size();
  measured.tiles.resize(levels), measured.outside.resize(levels);
  for (std::size_t z = 0; z < levels; ++z) measured.tiles[z].resize(listing.levels[z].size());
  SurfaceCache cache(listing);
  std::mutex mutex;
  std::optional<Error> error;
  std::size_t done = 0;
  const std::vector<LayerBlock> blocks = blocks_of(surface);
  parallel_for(blocks.size(), threads, [&](std::size_t i) {
    {
      const std::lock_guard lock(mutex);
      if (error || progress.stopped()) return;
    }
    const auto posts = read_posts(surface, blocks[i]);
    if (!posts) {
      const std::lock_guard lock(mutex);
      if (!error) error = posts.error();
      return;
    }
    std::vector<char> anywhere(posts->size());
    for (std::size_t z = 0; z < levels; ++z) {
      if (listing.levels[z].empty()) continue;
      LevelMeasure level(int(z), listing, cache, surface.shapes());
      std::uint64_t outside = 0;
      for (std::size_t k = 0; k < posts->size(); ++k) {
        const Post& p = (*posts)[k];
        if (!std::isfinite(p.lon) || !std::isfinite(p.lat)) continue;
        const bool held = level.post(p);
        outside += !held, anywhere[k] |= char(held);
      }
      const std::lock_guard lock(mutex);
      measured.outside[z] += outside;
      for (const auto& [place, tile] : level.measured())
        merge(measured.tiles[z][std::size_t(place)], tile);
    }
    const std::lock_guard lock(mutex);
    for (std::size_t k = 0; k < posts->size(); ++k)
      if (std::isfinite((*posts)[k].lon) && std::isfinite((*posts)[k].lat))
        ++measured.posts, measured.nowhere += !anywhere[k];
    if (++done % 8 == 0) progress.at(double(done) / double(blocks.size()));
  });
  if (error) return std::unexpected(*error);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  measured.unread = cache.unread();
  return measured;
}

}  // namespace tind
