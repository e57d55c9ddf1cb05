#include "server/cli/options/drape_input.h"

namespace tind::cli {

std::vector<std::string> DrapeInput::files() const {
  std::vector<std::string> names;
  for (const std::string& name : {image, land_cover})
    if (!name.empty()) names.push_back(name);
  return names;
}

void add_drape_options(Command c, DrapeInput& drape) {
  c.add_option("--drape", drape.image,
               "an image that says where it is (GeoTIFF): colours of the vertices of 3D Tiles "
               "(quantized-mesh has none), and what --method attribute-qem keeps in any tiles");
  c.add_option(
      "--land-cover", drape.land_cover,
      "a raster of classes that says where it is: each triangle of 3D Tiles is a feature of "
      "its class, with number, name and colour (EXT_mesh_features)");
}

Result<Draped> open_drape(const DrapeInput& drape, bool of_3d_tiles, bool keeps_colours) {
  if (!of_3d_tiles && !keeps_colours && !drape.image.empty())
    return fail(Errc::invalid_argument,
                "--drape is of 3D Tiles, and of tiles whose method keeps colours: add --format "
                "3dtiles, or --method attribute-qem");
  if (!of_3d_tiles && !drape.land_cover.empty())
    return fail(Errc::invalid_argument, "--land-cover is of 3D Tiles: add --format 3dtiles");
  return open_draped(drape.image, drape.land_cover);
}

Result<void> check_drape(const DrapeInput& drape, const Draped& draped, const Surface& surface) {
  const GeoRect& dem = surface.info().bounds;
  const auto beside = [](const std::string& file) {
    return fail(Errc::invalid_argument, file + " lies elsewhere: not on the DEM");
  };
  if (draped.colours && !draped.colours->bounds().overlaps(dem)) return beside(drape.image);
  if (draped.cover && !draped.cover->bounds().overlaps(dem)) return beside(drape.land_cover);
  return {};
}

}  // namespace tind::cli
