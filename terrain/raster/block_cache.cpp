#include "terrain/raster/block_cache.h"

namespace tind {
namespace {

std::size_t size_of(const HeightGrid& block) { return block.size() * sizeof(float); }

}  // namespace

BlockCache::Block BlockCache::find(std::uint64_t key) {
  const std::lock_guard lock(mutex_);
  const auto found = where_.find(key);
  if (found == where_.end()) return nullptr;
  order_.splice(order_.begin(), order_, found->second);
  return found->second->block;
}

void BlockCache::insert(std::uint64_t key, Block block) {
  const std::lock_guard lock(mutex_);
  if (where_.contains(key)) return;
  bytes_ += size_of(*block);
  order_.push_front({key, std::move(block)});
  where_[key] = order_.begin();
  while (bytes_ > max_bytes_ && order_.size() > 1) {
    bytes_ -= size_of(*order_.back().block);
    where_.erase(order_.back().key);
    order_.pop_back();
  }
}

std::size_t BlockCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace tind
