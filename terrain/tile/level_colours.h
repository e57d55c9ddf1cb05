#pragma once
// An image's colours as the tiles of a level show them.

#include <span>
#include <vector>

#include "terrain/raster/image_colours.h"

namespace tind {

/// A function of place and level alone, so neighbours have the same where they meet: the image as
/// coarse as a 64th of the level's tiles, about what vertices can show; white where it is not.
/// Empty where it is at none of the places.
std::vector<ImageColours::Linear> level_colours(std::span<const Geographic>, int level,
                                                const ImageColours&);

}  // namespace tind
