#pragma once
// An LRU cache of decoded blocks of heights, bounded in bytes. Thread-safe.

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "terrain/raster/height_grid.h"

namespace tind {

class BlockCache {
 public:
  using Block = std::shared_ptr<const HeightGrid>;

  /// At least one block is kept, however small the bound.
  explicit BlockCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// nullptr where absent.
  Block find(std::uint64_t key);
  /// Of two blocks for one key the first stays.
  void insert(std::uint64_t key, Block);

  std::size_t bytes() const;

 private:
  struct Entry {
    std::uint64_t key;
    Block block;
  };
  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::size_t bytes_ = 0;
  std::list<Entry> order_;  // most recently used first
  std::unordered_map<std::uint64_t, std::list<Entry>::iterator> where_;
};

}  // namespace tind
