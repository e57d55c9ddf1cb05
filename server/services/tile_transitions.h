#pragma once
// The ways from parents to tiles, for /transition.

#include "server/services/tile_products.h"

namespace tind::services {

class TileTransitions : public TileProducts {
 public:
  TileTransitions(TileCache& cache, CpuPool& pool);
};

}  // namespace tind::services
