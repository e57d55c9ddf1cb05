#pragma once
// The ways from parents to tiles, for /transition.

#include "server/services/tiles/tile_products.h"
#include "server/services/tiles/tile_service.h"

namespace tind::services {

class TileTransitions : public TileProducts {
 public:
  TileTransitions(TileService& tiles, TileCache& cache, CpuPool& pool);
};

}  // namespace tind::services
