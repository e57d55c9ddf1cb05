#pragma once
// A tile set as 3D Tiles 1.1 with implicit tiling: tileset.json, subtrees, contents, each made of
// finished tiles. The EPSG:4326 pyramid has two roots, so there are two implicit tilesets, one for
// each hemisphere, with columns of their own.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/encode/glb_tile.h"
#include "terrain/raster/draped.h"
#include "terrain/store/tile_set.h"
#include "terrain/tile/tile_model.h"

namespace tind::tiles3d {

/// A subtree has so many levels, 21 tiles. More would mean fewer requests, but a subtree says the
/// measured errors and heights of its tiles, and so takes as long as making them all.
inline constexpr int kSubtreeLevels = 3;

/// Which tiles there are, and how to get one that is there. Both are called with tiles of `set`
/// alone.
struct Source {
  const TileSet& set;
  std::function<Result<TileModel>(TileId)> tile;
  GlbCompression compression =
      GlbCompression::none;  // of the contents, which subtrees speak of, too
  Draped draped = {};        // over them, by their vertices (tile_drape.h)

  /// Of the tiles and what lies over them, as tileset.json says it.
  std::string version() const;
};

/// The tile at {west,east}/{level}/{x}/{y}, x from the west of the hemisphere, y from the south;
/// nothing where that is none of the pyramid.
std::optional<TileId> tile_at(std::string_view hemisphere, std::int64_t level, std::int64_t x,
                              std::int64_t y);
/// "west/3/1/2".
std::string path_of(TileId);

/// Do clients of 3D Tiles find into the set? They need its roots. not_found says why they do not.
Result<void> has_roots(const TileSet&);

/// The tiles that clients find, each after its parent. Those of a level that is a multiple of
/// kSubtreeLevels are roots of subtrees.
void each_tile(const TileSet&, const std::function<void(TileId)>& take);
/// Of these, the ones of a subtree, its root first.
std::vector<TileId> tiles_of_subtree(const TileSet&, TileId root);

/// REQUIRES, as the next: has_roots().
Result<std::string> tileset_json(const Source&);
/// REQUIRES: the set has the tile, and a level that is a multiple of kSubtreeLevels.
/// `take_content`: gets the content of every tile in it, on the way; what it fails with is the
/// result.
using TakeContent = std::function<Result<void>(TileId, const std::vector<std::uint8_t>&)>;
Result<std::vector<std::uint8_t>> subtree(const Source&, TileId root,
                                          const TakeContent& take_content = {});
/// REQUIRES: the set has the tile.
Result<std::vector<std::uint8_t>> content(const Source&, TileId);

}  // namespace tind::tiles3d
