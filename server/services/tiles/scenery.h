#pragma once
// FlightGear's scenery of a dataset (terrain/flightgear), for /terrasync.

#include "server/services/tiles/tile_products.h"
#include "terrain/flightgear/bucket_plan.h"
#include "terrain/geo/environment.h"

namespace tind::services {

/// Each is made once however many ask, at the addresses below. Errc::not_found where no post is
/// valid.
struct Scenery {
  Scenery(TileCache& cache, CpuPool& pool, const Environment& environment);

  TileProducts grounds;  // .btg.gz
  TileProducts stgs;     // .stg; made with the ground, and the other way round
  TileProducts indices;  // .dirindex of a folder of a degree: takes all buckets in it

  /// Products are kept by addresses of tiles' kind; these are told apart by their variants.
  static TileId address(flightgear::BucketId id) { return {0, flightgear::index_of(id), 0}; }
  static TileId address(flightgear::Folder f) {
    return {0, std::uint32_t(f.lon + 180), std::uint32_t(f.lat + 90)};
  }
};

}  // namespace tind::services
