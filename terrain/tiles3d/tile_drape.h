#pragma once
// What lies over a tile: its vertices' colours, the same for neighbours where they meet, and its
// triangles' classes.

#include "terrain/encode/glb_tile.h"
#include "terrain/raster/draped.h"
#include "terrain/tile/tile_model.h"

namespace tind::tiles3d {

/// Colours are a function of place and level alone: those of the image as coarse as a 64th of the
/// level's tiles, about what vertices can show; white where it is not. The class of a triangle is
/// that of the pixels that its corners lie in, or where these differ, its middle; only those that a
/// triangle has are listed, by number. None of either where there is nothing.
GlbDrape tile_drape(const TileModel&, const Draped&);

}  // namespace tind::tiles3d
