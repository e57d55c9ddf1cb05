#pragma once
// The colours of an image over a tile's vertices: what clients draw, and what a method that knows
// colours keeps.

#include <array>
#include <span>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/raster/image_colours.h"

namespace tind {

/// A function of place and level alone, so that neighbours agree where they meet: the image's, as
/// coarse as a 64th of the level's tiles, about what vertices can show; white where it is not.
/// Nothing where none of the places lies in the image. O(places).
std::vector<std::array<float, 3>> tile_colours(std::span<const Geographic> places, int level,
                                               const ImageColours& image);

}  // namespace tind
