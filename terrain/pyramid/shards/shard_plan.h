#pragma once
// What many machines make of one surface, and which tiles each of them: a pure function of heights
// and options, so that everybody who reads it makes the same tiles. A shard is a run of subtrees
// along the Hilbert curve of one level; the tiles above that level are the top, made last.
// docs/formats.md has the file.

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/availability.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/shapes/shape_files.h"
#include "terrain/store/build_record.h"

namespace tind {

/// What is to be opened, in the words of the command line. Another machine may have the same files
/// elsewhere: no part of the plan's hash.
struct PlannedSource {
  std::vector<std::string> files;
  std::vector<std::pair<std::string, std::string>> options;  // of dem_options_text.h
  std::vector<std::string> layers, blends, layer_errors, layer_options;
  ShapeFiles shapes;
  bool allow_vrt = false;
};

struct ShardPlan {
  struct Shard {
    std::uint64_t subtrees = 0, tiles = 0;
    std::uint64_t cost = 0;  // in units of its own: to be compared with that of other shards
    friend bool operator==(const Shard&, const Shard&) = default;
  };

  BuildRecord record;      // of the tile set that comes of it
  std::string layer_text;  // its layer.json
  std::string blocks;      // SurfaceBlocks::encode()
  int level = 0;           // of the subtrees' roots
  std::vector<Shard> shards;
  std::uint64_t top_tiles = 0;
  PlannedSource source;

  std::uint64_t tiles() const;
  /// 64 digits (SHA-256) that stand for all but `source`.
  std::string hash() const;
};

inline constexpr std::size_t kMostShards = 100'000;
inline constexpr std::uint64_t kMostSubtrees = 4'000'000;

std::string encode(const ShardPlan&);
/// bad_data for what encode() cannot have made of a plan that holds together: other members, a hash
/// that is not its own, tiles that are not in the layer, or numbers that do not add up.
Result<ShardPlan> decode_shard_plan(std::string_view text);

/// What of its pyramid a plan gives to whom. The plan must outlive it.
class ShardTiles {
 public:
  static constexpr std::size_t kTop = std::size_t(-1);  // in place of a shard's number

  /// bad_data where the plan's layer has no such tiles.
  static Result<ShardTiles> of(const ShardPlan&);

  /// By level: the tiles of a shard. O(subtrees of the shard).
  std::vector<TileArea> areas(std::size_t shard) const;
  /// The same, one after the other as an archive has them.
  std::vector<TileId> in_order(std::size_t shard) const;
  /// Roots of its subtrees, along the curve; none of the top.
  std::vector<TileId> roots(std::size_t shard) const;
  /// Tiles of a level no deeper than the subtrees', each with the shard that has the first of the
  /// subtrees below it along the curve.
  std::map<TileId, std::size_t> first_shards(int level) const;
  /// Whose tile it is. REQUIRES: one of the plan's.
  std::size_t shard_of(TileId) const;
  std::size_t shards() const { return begins_.size() - 1; }
  const proto::LayerJson& layer() const { return layer_; }
  /// layer.json of a shard alone.
  proto::LayerJson layer_of(std::size_t shard) const;

 private:
  const ShardPlan* plan_ = nullptr;
  proto::LayerJson layer_;
  std::vector<TileArea> areas_;        // by level
  std::vector<TileId> roots_;          // of all shards, along the curve
  std::vector<std::uint64_t> begins_;  // by shard, in roots_; and their number
};

/// Along the curve of an archive's numbers.
std::uint64_t curve_number(TileId);

}  // namespace tind
