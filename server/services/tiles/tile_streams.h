#pragma once
// Tiles as progressive meshes, for /progressive.

#include "server/services/tiles/tile_products.h"
#include "server/services/tiles/tile_service.h"

namespace tind::services {

class TileStreams : public TileProducts {
 public:
  using Stream = Product;

  TileStreams(TileService& tiles, TileCache& cache, CpuPool& pool);
};

}  // namespace tind::services
