#pragma once
// What lies over a surface and is no part of it.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/image_colours.h"
#include "terrain/raster/land_cover.h"

namespace tind {

struct Draped {
  std::shared_ptr<const ImageColours> colours = {};  // null: none; as the next
  std::shared_ptr<const LandCover> cover = {};
};

/// By the paths of an image and of a raster of classes, either of which may be empty. Fails as
/// opening them does.
Result<Draped> open_draped(const std::string& image, const std::string& land_cover);

/// Fails (invalid_argument) where one of the two lies wholly beside the terrain: nobody would see
/// anything of it. By the paths of open_draped().
Result<void> check_lies_on(const GeoRect& terrain, const Draped&, const std::string& image,
                           const std::string& land_cover);

}  // namespace tind
