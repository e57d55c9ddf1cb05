#pragma once
// Finished tiles in memory, ready to send; bounded in bytes, least recently used goes first.

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>

#include "server/http/message/representation.h"
#include "terrain/base/lru.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind::services {

struct TileKey {
  std::uint32_t dataset = 0;
  TileId tile;
  std::uint8_t variant = 0;  // which extensions it carries, or one of these
  std::uint32_t detail = 0;  // what else was asked, as a number of the variant's own

  static constexpr std::uint8_t kWhole = 7;       // with all extensions that the dataset has
  static constexpr std::uint8_t kStream = 8;      // the tile as a progressive mesh
  static constexpr std::uint8_t kTransition = 9;  // from the parent's part to the tile
  static constexpr std::uint8_t kContent3d = 10;  // of 3D Tiles: the tile's GLB
  static constexpr std::uint8_t kSubtree3d = 11;  // the subtree that begins at the tile
  static constexpr std::uint8_t kTileset3d = 12;  // of tile 0/0/0: tileset.json
  static constexpr std::uint8_t kMeshopt3d = 3;   // and so many more: the same, compressed
  static constexpr std::uint8_t kEncodings = 16;  // and above: other formats of the tile
  // Of a web map's tile at this address; `detail` says which.
  static constexpr std::uint8_t kHeightImages = 128;
  static constexpr std::uint8_t kShades = 160;
  static constexpr std::uint8_t kGround = 192;    // of FlightGear's bucket at this address: .btg.gz
  static constexpr std::uint8_t kStg = 193;       // its .stg
  static constexpr std::uint8_t kDirIndex = 194;  // .dirindex of the folder at this address
  friend bool operator==(const TileKey&, const TileKey&) = default;
};

/// Thread-safe. Split in shards by the key's hash so that I/O threads seldom meet at a lock.
class TileCache {
 public:
  using Tile = std::shared_ptr<const http::Representation>;

  explicit TileCache(std::size_t max_bytes);

  /// Null when it is not here.
  Tile find(const TileKey&);
  /// The same, and does not count as a use.
  Tile peek(const TileKey&) const;
  /// A tile larger than a shard's share is not kept.
  void insert(const TileKey&, Tile);

  std::size_t bytes() const;
  std::size_t tiles() const;
  std::uint64_t evictions() const { return evictions_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kShards = 16;
  struct Hash {
    std::size_t operator()(const TileKey&) const;
  };
  struct Shard {
    explicit Shard(std::size_t bytes) : tiles(bytes) {}
    mutable std::mutex mutex;
    Lru<TileKey, Tile, Hash> tiles;
  };

  Shard& shard_of(const TileKey& key) { return shards_[Hash{}(key) >> 60]; }
  const Shard& shard_of(const TileKey& key) const { return shards_[Hash{}(key) >> 60]; }

  const std::size_t shard_bytes_;
  std::deque<Shard> shards_;
  std::atomic<std::uint64_t> evictions_{0};
};

}  // namespace tind::services
