#include "terrain/raster/gdal/source_pool.h"

namespace tind {

std::shared_ptr<SourcePool> SourcePool::make(const Limits& limits) {
  return std::make_shared<gdal::Pool>(limits);
}

namespace gdal {
namespace {

constexpr std::size_t kOpenFilesOfOne = 32;

}  // namespace

Pool::Pool(const Limits& limits)
    : idle(std::make_shared<IdleHandles>(limits.unpacked_bytes, limits.open_files)),
      heights(limits.heights_bytes) {}

std::shared_ptr<Pool> Pool::of(const DemOptions& options) {
  if (options.pool) return std::static_pointer_cast<Pool>(options.pool);
  return std::make_shared<Pool>(SourcePool::Limits{.heights_bytes = options.cache_bytes,
                                                   .unpacked_bytes = options.unpacked_bytes,
                                                   .open_files = kOpenFilesOfOne});
}

}  // namespace gdal
}  // namespace tind
