#pragma once
// What a SourcePool is made of.

#include <memory>
#include <utility>

#include "terrain/raster/block_cache.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/heights/gdal_file.h"
#include "terrain/raster/sandbox/team.h"

namespace tind::gdal {

struct Pool final : SourcePool {
  explicit Pool(const Limits&, std::shared_ptr<sandbox::Team> = nullptr);
  /// With the same files and heights.
  Pool(const Pool& other, std::shared_ptr<sandbox::Team> processes, bool no_exception)
      : idle(other.idle),
        heights(other.heights),
        team(std::move(processes)),
        strict(no_exception) {}
  /// That of the options, or one for their source alone.
  static std::shared_ptr<Pool> of(const DemOptions&);

  const std::shared_ptr<IdleHandles> idle;
  const std::shared_ptr<BlockCache> heights;
  const std::shared_ptr<sandbox::Team> team;  // reads the files; null: this process does
  const bool strict = false;                  // what the team cannot read nobody reads
};

}  // namespace tind::gdal
