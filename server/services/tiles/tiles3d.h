#pragma once
// 3D Tiles of a dataset (terrain/tiles3d), for /3dtiles.

#include "server/services/tiles/tile_products.h"
#include "server/services/tiles/tile_service.h"
#include "terrain/encode/glb_tile.h"

namespace tind::services {

/// A tileset of one compression. Each is made once however many ask. What names others
/// (tileset.json, subtrees) and what is named are asked for again each time: their addresses do not
/// change with the content.
struct Tileset3d {
  Tileset3d(TileService& tiles, TileCache& cache, CpuPool& pool, GlbCompression);

  TileProducts contents;  // of a tile
  TileProducts subtrees;  // of the tile where one begins: a level that is a multiple of
                          // tiles3d::kSubtreeLevels
  TileProducts tilesets;  // of tile 0/0/0
};

struct Tiles3d {
  Tiles3d(TileService& tiles, TileCache& cache, CpuPool& pool);

  Tileset3d plain, meshopt;
};

}  // namespace tind::services
