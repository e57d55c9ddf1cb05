#pragma once
// What tiles are to be made of a DEM.

#include <cstdint>
#include <string>

namespace tind {

struct TileSetOptions {
  double max_error_m = 0;   // at the leaves; 0: 1/32 of the post spacing
  double error_factor = 1;  // budget of level z: level_error(z) * factor
  int max_level = -1;  // where the pyramid ends; -1: the first level at least as fine as the source
  int first_level =
      0;  // levels that are made and offered of it: no byte of a tile depends on which
  int last_level = -1;        // -1: down to the end
  std::string side = "both";  // both | above | below: where the mesh lies as seen from the posts
  std::string effort = "normal";
  /// Tiles of more posts than this are certified through the residual index; 0: as
  /// residual_index.h says.
  std::int64_t exact_posts = 0;
};

}  // namespace tind
