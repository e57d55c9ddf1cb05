#include "terrain/raster/draped.h"

namespace tind {

Result<Draped> open_draped(const std::string& image, const std::string& land_cover) {
  Draped draped;
  if (!image.empty()) {
    auto colours = ImageColours::open(image);
    if (!colours) return std::unexpected(colours.error());
    draped.colours = std::move(*colours);
  }
  if (!land_cover.empty()) {
    auto cover = LandCover::open(land_cover);
    if (!cover) return std::unexpected(cover.error());
    draped.cover = std::move(*cover);
  }
  return draped;
}

}  // namespace tind
