#pragma once
// Tiles in the formats beside quantized-mesh (terrain/encode), each made of the finished tile.

#include <memory>
#include <vector>

#include "server/services/tiles/tile_products.h"
#include "server/services/tiles/tile_service.h"
#include "terrain/encode/tile_encoder.h"

namespace tind::services {

class TileEncodings {
 public:
  TileEncodings(TileService& tiles, TileCache& cache, CpuPool& pool);

  struct Encoding {
    const TileEncoder& format;
    std::unique_ptr<TileProducts> products;
  };
  const std::vector<Encoding>& all() const { return all_; }

 private:
  std::vector<Encoding> all_;
};

}  // namespace tind::services
