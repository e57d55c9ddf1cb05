#include "terrain/raster/block_cache.h"

#include <atomic>

namespace tind {

std::uint64_t BlockCache::new_source() {
  static std::atomic<std::uint64_t> next{0};
  return next.fetch_add(1, std::memory_order_relaxed);
}

BlockCache::Block BlockCache::find(const Key& key) {
  const std::lock_guard lock(mutex_);
  const Block* found = blocks_.find(key);
  return found ? *found : nullptr;
}

void BlockCache::insert(const Key& key, Block block) {
  const std::size_t bytes = block->size() * sizeof(float);
  decltype(blocks_)::Entries gone;  // freed after the lock
  const std::lock_guard lock(mutex_);
  if (!blocks_.peek(key)) gone = blocks_.insert(key, std::move(block), bytes);
}

void BlockCache::forget(std::uint64_t source) {
  decltype(blocks_)::Entries gone;  // freed after the lock
  const std::lock_guard lock(mutex_);
  gone = blocks_.take_if([source](const Key& key) { return key.source == source; });
}

std::size_t BlockCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return blocks_.weight();
}

}  // namespace tind
