#include "server/services/tiles/tile_cache.h"

namespace tind::services {
namespace {

constexpr std::size_t kEntryOverhead = 160;  // list and hash nodes

/// What a tile really costs: blocks of many sizes that come and go leave about an eighth unused
/// between them.
std::size_t cost_of(const http::Representation& tile) {
  return tile.memory_bytes() + tile.memory_bytes() / 8 + kEntryOverhead;
}

std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
  return h ^ (h >> 32);
}

}  // namespace

std::size_t TileCache::Hash::operator()(const TileKey& key) const {
  const std::uint64_t place = (std::uint64_t(key.tile.x) << 32) | key.tile.y;
  const std::uint64_t rest = (std::uint64_t(key.dataset) << 16) |
                             (std::uint64_t(std::uint8_t(key.tile.level)) << 8) | key.variant;
  const std::uint64_t detail = std::uint64_t(key.detail) * 0xd6e8feb86659fd93u;
  return mix(place ^ mix(rest + detail + 0x9e3779b97f4a7c15u));
}

TileCache::TileCache(std::size_t max_bytes) : shard_bytes_(max_bytes / kShards) {
  for (std::size_t i = 0; i < kShards; ++i) shards_.emplace_back(shard_bytes_);
}

TileCache::Tile TileCache::find(const TileKey& key) {
  Shard& shard = shard_of(key);
  const std::lock_guard lock(shard.mutex);
  const Tile* found = shard.tiles.find(key);
  return found ? *found : nullptr;
}

TileCache::Tile TileCache::peek(const TileKey& key) const {
  const Shard& shard = shard_of(key);
  const std::lock_guard lock(shard.mutex);
  const Tile* found = shard.tiles.peek(key);
  return found ? *found : nullptr;
}

void TileCache::insert(const TileKey& key, Tile tile) {
  const std::size_t bytes = cost_of(*tile);
  if (bytes > shard_bytes_) return;
  Shard& shard = shard_of(key);
  decltype(shard.tiles)::Entries gone;  // freed after the lock
  const std::lock_guard lock(shard.mutex);
  gone = shard.tiles.insert(key, std::move(tile), bytes);
  evictions_.fetch_add(gone.size(), std::memory_order_relaxed);
}

std::size_t TileCache::bytes() const {
  std::size_t sum = 0;
  for (const Shard& shard : shards_) {
    const std::lock_guard lock(shard.mutex);
    sum += shard.tiles.weight();
  }
  return sum;
}

std::size_t TileCache::tiles() const {
  std::size_t sum = 0;
  for (const Shard& shard : shards_) {
    const std::lock_guard lock(shard.mutex);
    sum += shard.tiles.size();
  }
  return sum;
}

}  // namespace tind::services
