#include "terrain/raster/gdal/heights/source_pool.h"

#include <utility>

#include "terrain/raster/sandboxed_pool.h"

namespace tind {

std::shared_ptr<SourcePool> SourcePool::make(const Limits& limits) {
  return std::make_shared<gdal::Pool>(limits);
}

std::shared_ptr<SourcePool> sandboxed_pool(const SourcePool::Limits& limits,
                                           sandbox::TeamOptions options) {
  return std::make_shared<gdal::Pool>(limits, std::make_shared<sandbox::Team>(std::move(options)));
}

std::shared_ptr<SourcePool> without_sandbox(const std::shared_ptr<SourcePool>& pool) {
  const auto own = std::static_pointer_cast<gdal::Pool>(pool);
  return own && own->team ? std::make_shared<gdal::Pool>(*own, nullptr, false) : pool;
}

std::shared_ptr<SourcePool> without_exceptions(const std::shared_ptr<SourcePool>& pool) {
  const auto own = std::static_pointer_cast<gdal::Pool>(pool);
  return own && own->team ? std::make_shared<gdal::Pool>(*own, own->team, true) : pool;
}

namespace gdal {
namespace {

constexpr std::size_t kOpenFilesOfOne = 32;

}  // namespace

Pool::Pool(const Limits& limits, std::shared_ptr<sandbox::Team> processes)
    : idle(std::make_shared<IdleHandles>(limits.unpacked_bytes, limits.open_files)),
      heights(std::make_shared<BlockCache>(limits.heights_bytes)),
      team(std::move(processes)) {}

std::shared_ptr<Pool> Pool::of(const DemOptions& options) {
  if (options.pool) return std::static_pointer_cast<Pool>(options.pool);
  return std::make_shared<Pool>(SourcePool::Limits{.heights_bytes = options.cache_bytes,
                                                   .unpacked_bytes = options.unpacked_bytes,
                                                   .open_files = kOpenFilesOfOne});
}

}  // namespace gdal
}  // namespace tind
