#pragma once
// Heights as tiles of web maps (terrain/images), for /rgb: one kind of product for each way to say
// heights in colours.

#include <array>
#include <memory>

#include "proto/height_png.h"
#include "server/services/tiles/tile_products.h"
#include "terrain/geo/web_mercator.h"

namespace tind::services {

class HeightImages {
 public:
  HeightImages(TileCache& cache, CpuPool& pool);

  TileProducts& of(proto::HeightCode code) { return *all_[std::size_t(code)]; }

  /// Products are kept by addresses of the tiles' own kind; these are told apart by their variant.
  static TileId address(web_mercator::Tile t) { return {t.level, t.x, t.y}; }

 private:
  std::array<std::unique_ptr<TileProducts>, 2> all_;  // by HeightCode
};

}  // namespace tind::services
