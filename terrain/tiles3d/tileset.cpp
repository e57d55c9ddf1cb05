// A subtree is asked of its root: down through the tiles that are there, so that none is said to be
// there without its parent, and up again, so that a parent's error is never below its children's.

#include "terrain/tiles3d/tileset.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "proto/tile/tiles3d.h"
#include "terrain/tiles3d/tile3d.h"
#include "terrain/tiles3d/tile_drape.h"

namespace tind::tiles3d {
namespace {

constexpr std::uint32_t tiles_above(int level) {  // of the levels before it
  return ((1u << (2 * level)) - 1) / 3;
}

bool has(const TileSet& set, TileId id) {
  return id.level <= tiling::kMaxLevel && set.available(id);
}

bool is_leaf(const TileSet& set, TileId id) {
  for (const int north : {0, 1})
    for (const int east : {0, 1})
      if (has(set, id.child(east, north))) return false;
  return true;
}

/// Nothing above level 0, and where the set leaves it out.
Result<std::optional<TileModel>> parent_of(const Source& source, TileId id) {
  if (id.level == 0 || !has(source.set, id.parent())) return std::nullopt;
  auto parent = source.tile(id.parent());
  if (!parent) return std::unexpected(parent.error());
  return std::optional(std::move(*parent));
}

std::vector<std::uint8_t> content_of(const Source& source, const TileModel& tile,
                                     const TileModel* parent) {
  return tiles3d::content(tile, parent, source.compression, tile_drape(tile, source.draped));
}

template <class Take>
void walk(const TileSet& set, TileId id, int last, const Take& take) {
  if (!has(set, id)) return;
  take(id);
  if (id.level == last) return;
  for (const int north : {0, 1})
    for (const int east : {0, 1}) walk(set, id.child(east, north), last, take);
}

/// Grows a tile's volumes around a child's.
void hold(proto::Tile3d& tile, const proto::Tile3d& child) {
  tile.geometric_error = std::max(tile.geometric_error, child.geometric_error);
  tile.min_height = std::min(tile.min_height, child.min_height);
  const auto &s = tile.sphere, &c = child.sphere;
  const double apart = std::hypot(c[0] - s[0], c[1] - s[1], c[2] - s[2]);
  tile.sphere[3] = std::max(tile.sphere[3], apart + c[3]);
}

class SubtreeMaker {
 public:
  SubtreeMaker(const Source& source, TileId root, const TakeContent& take)
      : source_(source), root_(root), take_(take) {
    made_.tiles.resize(tiles_above(kSubtreeLevels));
    made_.children.resize(std::size_t(1) << (2 * kSubtreeLevels));
  }

  Result<std::vector<std::uint8_t>> make() {
    const auto parent = parent_of(source_, root_);
    if (!parent) return std::unexpected(parent.error());
    const auto says = add(root_, 0, *parent ? &**parent : nullptr);
    if (!says) return std::unexpected(says.error());
    return proto::encode(made_);
  }

 private:
  const Source& source_;
  TileId root_;
  const TakeContent& take_;
  proto::Subtree made_;

  /// Among the tiles of its level of the subtree.
  std::uint32_t number(TileId id, int depth) const {
    return proto::morton(id.x - (root_.x << depth), id.y - (root_.y << depth));
  }

  /// Error and volumes of the tile, with all below it that are in the subtree: where posts are
  /// void nothing but the fill says how far children lie from it.
  Result<std::optional<proto::Tile3d>> add(TileId id, int depth, const TileModel* parent) {
    if (depth == kSubtreeLevels) {
      made_.children[number(id, depth)] = true;
      return std::nullopt;
    }
    const auto tile = source_.tile(id);
    if (!tile) return std::unexpected(tile.error());
    if (take_)
      if (auto taken = take_(id, content_of(source_, *tile, parent)); !taken)
        return std::unexpected(taken.error());
    const bool leaf = is_leaf(source_.set, id);
    std::vector<proto::Tile3d> below;
    for (const int north : {0, 1})
      for (const int east : {0, 1}) {
        const TileId child = id.child(east, north);
        if (!has(source_.set, child)) continue;
        const auto added = add(child, depth + 1, &*tile);
        if (!added) return added;
        if (*added) below.push_back(**added);
      }
    auto says = facts(*tile, parent, leaf, source_.compression);
    double higher = 0;
    for (const proto::Tile3d& child : below)
      higher = std::max(higher, child.max_height - says.max_height);
    if (higher > 0) says = facts(*tile, parent, leaf, source_.compression, higher);
    for (const proto::Tile3d& child : below) hold(says, child);
    made_.tiles[tiles_above(depth) + number(id, depth)] = says;
    return says;
  }
};

}  // namespace

std::string Source::version() const {
  constexpr std::size_t kDigits = 12;
  std::string all = set.layer().version;
  if (draped.colours) all += "-" + draped.colours->fingerprint().substr(0, kDigits);
  if (draped.cover) all += "-" + draped.cover->fingerprint().substr(0, kDigits);
  return all;
}

std::optional<TileId> tile_at(std::string_view hemisphere, std::int64_t level, std::int64_t x,
                              std::int64_t y) {
  if ((hemisphere != "west" && hemisphere != "east") || level < 0 || level > tiling::kMaxLevel)
    return {};
  const std::int64_t columns = tiling::rows(int(level));  // of one hemisphere
  if (x < 0 || x >= columns) return {};
  return tiling::tile(level, hemisphere == "east" ? x + columns : x, y);
}

std::string path_of(TileId id) {
  const std::uint32_t columns = tiling::rows(id.level);
  const bool east = id.x >= columns;
  return (east ? "east/" : "west/") + TileId{id.level, east ? id.x - columns : id.x, id.y}.text();
}

Result<void> has_roots(const TileSet& set) {
  if (set.available({0, 0, 0}) && set.available({0, 1, 0})) return {};
  return fail(Errc::not_found,
              "3D Tiles need both tiles of level 0, and this set begins at level " +
                  std::to_string(set.layer().minzoom));
}

void each_tile(const TileSet& set, const std::function<void(TileId)>& take) {
  for (const TileId root : {TileId{0, 0, 0}, TileId{0, 1, 0}})
    walk(set, root, set.layer().maxzoom, take);
}

std::vector<TileId> tiles_of_subtree(const TileSet& set, TileId root) {
  std::vector<TileId> all;
  walk(set, root, std::min(set.layer().maxzoom, root.level + kSubtreeLevels - 1),
       [&](TileId id) { all.push_back(id); });
  return all;
}

Result<std::string> tileset_json(const Source& source) {
  const proto::LayerJson& layer = source.set.layer();
  proto::Tileset3d made{.name = layer.name,
                        .version = source.version(),
                        .attribution = layer.attribution,
                        .min_height = HUGE_VAL,
                        .max_height = -HUGE_VAL,
                        .levels = layer.maxzoom + 1,
                        .subtree_levels = kSubtreeLevels,
                        .accuracy = layer.accuracy};
  for (const TileId root : {TileId{0, 0, 0}, TileId{0, 1, 0}}) {
    const auto tile = source.tile(root);
    if (!tile) return std::unexpected(tile.error());
    const proto::Tile3d says = facts(*tile, nullptr, is_leaf(source.set, root), source.compression);
    made.geometric_error =
        std::max({made.geometric_error, tiling::kLevelZeroError, tile->displayed_error_m});
    made.min_height = std::min(made.min_height, says.min_height);
    made.max_height = std::max(made.max_height, says.max_height);
  }
  return proto::encode(made);
}

Result<std::vector<std::uint8_t>> subtree(const Source& source, TileId root,
                                          const TakeContent& take_content) {
  return SubtreeMaker(source, root, take_content).make();
}

Result<std::vector<std::uint8_t>> content(const Source& source, TileId id) {
  const auto tile = source.tile(id);
  if (!tile) return std::unexpected(tile.error());
  const auto parent = parent_of(source, id);
  if (!parent) return std::unexpected(parent.error());
  return content_of(source, *tile, *parent ? &**parent : nullptr);
}

}  // namespace tind::tiles3d
