#pragma once
// What a SourcePool is made of.

#include <memory>

#include "terrain/raster/block_cache.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/gdal_file.h"

namespace tind::gdal {

struct Pool final : SourcePool {
  explicit Pool(const Limits&);
  /// That of the options, or one for their source alone.
  static std::shared_ptr<Pool> of(const DemOptions&);

  const std::shared_ptr<IdleHandles> idle;
  BlockCache heights;
};

}  // namespace tind::gdal
