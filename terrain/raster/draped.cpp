#include "terrain/raster/draped.h"

namespace tind {

namespace {

/// Longitudes of either may go on across the antimeridian.
bool meet(const GeoRect& a, const GeoRect& b) {
  for (const double turn : {-360., 0., 360.})
    if (a.overlaps({b.west + turn, b.south, b.east + turn, b.north})) return true;
  return false;
}

}  // namespace

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

Result<void> check_lies_on(const GeoRect& terrain, const Draped& draped, const std::string& image,
                           const std::string& land_cover) {
  const auto beside = [](const std::string& file) {
    return fail(Errc::invalid_argument, file + " lies elsewhere: not on the terrain");
  };
  if (draped.colours && !meet(terrain, draped.colours->bounds())) return beside(image);
  if (draped.cover && !meet(terrain, draped.cover->bounds())) return beside(land_cover);
  return {};
}

}  // namespace tind
