#pragma once
// An LRU cache of decoded blocks of heights, bounded in bytes. Thread-safe.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "terrain/base/lru.h"
#include "terrain/raster/height_grid.h"

namespace tind {

class BlockCache {
 public:
  using Block = std::shared_ptr<const HeightGrid>;

  /// At least one block is kept, however small the bound.
  explicit BlockCache(std::size_t max_bytes) : blocks_(max_bytes, 1) {}

  /// nullptr where absent.
  Block find(std::uint64_t key);
  /// Of two blocks for one key the first stays.
  void insert(std::uint64_t key, Block);

  std::size_t bytes() const;

 private:
  mutable std::mutex mutex_;
  Lru<std::uint64_t, Block, std::hash<std::uint64_t>> blocks_;
};

}  // namespace tind
