#pragma once
// An LRU cache of decoded blocks of heights, of one source or of many, bounded in bytes.
// Thread-safe.

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

  /// Whose block, and which of its blocks.
  struct Key {
    std::uint64_t source = 0, block = 0;
    friend bool operator==(const Key&, const Key&) = default;
  };
  /// A source's part of its keys: no two of a process have the same.
  static std::uint64_t new_source();

  /// nullptr where absent.
  Block find(const Key&);
  /// Of two blocks for one key the first stays.
  void insert(const Key&, Block);
  /// Nobody will ask for this source's blocks any more.
  void forget(std::uint64_t source);

  std::size_t bytes() const;

 private:
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return std::hash<std::uint64_t>{}(key.block ^ key.source * 0x9e3779b97f4a7c15u);
    }
  };
  mutable std::mutex mutex_;
  Lru<Key, Block, Hash> blocks_;
};

}  // namespace tind
