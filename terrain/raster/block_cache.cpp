#include "terrain/raster/block_cache.h"

namespace tind {

BlockCache::Block BlockCache::find(std::uint64_t key) {
  const std::lock_guard lock(mutex_);
  const Block* found = blocks_.find(key);
  return found ? *found : nullptr;
}

void BlockCache::insert(std::uint64_t key, Block block) {
  const std::size_t bytes = block->size() * sizeof(float);
  decltype(blocks_)::Entries gone;  // freed after the lock
  const std::lock_guard lock(mutex_);
  if (!blocks_.peek(key)) gone = blocks_.insert(key, std::move(block), bytes);
}

std::size_t BlockCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return blocks_.weight();
}

}  // namespace tind
