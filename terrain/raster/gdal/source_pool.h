#pragma once
// What a SourcePool is made of.

#include <memory>

#include "terrain/raster/block_cache.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/gdal_file.h"
#include "terrain/raster/sandbox/team.h"

namespace tind::gdal {

struct Pool final : SourcePool {
  explicit Pool(const Limits&, std::shared_ptr<sandbox::Team> = nullptr);
  /// With the same files and heights, and no team.
  explicit Pool(const Pool& other) : idle(other.idle), heights(other.heights) {}
  /// That of the options, or one for their source alone.
  static std::shared_ptr<Pool> of(const DemOptions&);

  const std::shared_ptr<IdleHandles> idle;
  const std::shared_ptr<BlockCache> heights;
  const std::shared_ptr<sandbox::Team> team;  // reads the files; null: this process does
};

}  // namespace tind::gdal
