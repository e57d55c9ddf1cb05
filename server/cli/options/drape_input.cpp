#include "server/cli/options/drape_input.h"

#include <fmt/format.h>

#include <utility>

#include "server/cli/program/exit.h"

namespace tind::cli {

std::vector<std::string> DrapeInput::files() const {
  std::vector<std::string> names;
  for (const std::string& name : {image, land_cover})
    if (!name.empty()) names.push_back(name);
  return names;
}

void add_drape_options(Command c, DrapeInput& drape) {
  c.add_option("--drape", drape.image,
               "an image that says where it is (GeoTIFF): colours of the vertices of 3D Tiles; "
               "quantized-mesh has none");
  c.add_option(
      "--land-cover", drape.land_cover,
      "a raster of classes that says where it is: each triangle of 3D Tiles is a feature of "
      "its class, with number, name and colour (EXT_mesh_features)");
}

Result<Draped> open_drape(const DrapeInput& drape, bool of_3d_tiles) {
  for (const auto& [option, file] :
       {std::pair("--drape", &drape.image), std::pair("--land-cover", &drape.land_cover)})
    if (!of_3d_tiles && !file->empty())
      return fail(Errc::invalid_argument,
                  std::string(option) + " is of 3D Tiles: add --format 3dtiles");
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

Result<std::shared_ptr<const std::vector<Colour>>> drape_posts(const std::string& image,
                                                               const DemSource& dem) {
  auto drape = drape_image(image, dem);
  if (!drape) return std::unexpected(drape.error());
  if (drape->covered < 1)
    warn(fmt::format("{}: has no colour for {:.3g} % of the DEM, which is white there", image,
                     100 * (1 - drape->covered)));
  return std::make_shared<const std::vector<Colour>>(std::move(drape->colours));
}

}  // namespace tind::cli
