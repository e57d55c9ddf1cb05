#pragma once
// What tiles are to be made of a DEM.

#include <cstdint>
#include <memory>

#include "terrain/mesh/side.h"
#include "terrain/simplify/common/effort.h"
#include "terrain/simplify/options.h"

namespace tind {

class ImageColours;

struct TileSetOptions {
  double max_error_m = 0;   // at the leaves; 0: 1/32 of the post spacing
  double error_factor = 1;  // budget of level z: level_error(z) * factor
  int max_level = -1;  // where the pyramid ends; -1: the first level at least as fine as the source
  // Levels that are made and offered of it; -1: down to the end. No byte of a tile depends on them.
  int first_level = 0, last_level = -1;
  Side side = Side::both;
  /// Who makes the meshes of tiles: a method that check_tile_method lets pass. What bounded itself
  /// reads is not in here: `side` is everybody's, and `effort` also that of the tiles which bounded
  /// makes instead, where the method cannot keep a tile within its budget.
  MethodOptions method = {};
  Effort effort = Effort::normal;
  /// What is draped over the tiles, where the method makes meshes for its sake; null: nothing.
  std::shared_ptr<const ImageColours> colours = {};
  /// Tiles of more posts than this are certified through the residual index; 0: as
  /// residual_index.h says.
  std::int64_t exact_posts = 0;
};

}  // namespace tind
