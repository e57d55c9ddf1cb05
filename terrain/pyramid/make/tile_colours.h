#pragma once
// The colours that the vertices of one tile are to show.

#include <memory>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/simplify/common/held_colours.h"

namespace tind {

/// Of the image for whose sake the tiles' method makes meshes (tile_method.h), over the square of
/// the tile's lattice; null where there is none, or it is elsewhere. O(the lattice of nodes).
std::shared_ptr<const HeldColours> tile_colours(const TileSetOptions&, TileId);

}  // namespace tind
