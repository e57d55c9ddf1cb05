#include "server/cli/options/drape_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "server/cli/program/exit.h"
#include "terrain/flightgear/cover_materials.h"

namespace tind::cli {
namespace {

Result<void> check_fits(const DrapeInput& drape, DrapedOver over) {
  if (!drape.image.empty() && over != DrapedOver::tiles3d)
    return fail(Errc::invalid_argument, "--drape is of 3D Tiles: add --format 3dtiles");
  if (!drape.land_cover.empty() && over == DrapedOver::nothing)
    return fail(Errc::invalid_argument,
                "--land-cover is of 3D Tiles and of FlightGear's scenery: add --format 3dtiles or "
                "flightgear");
  if (!drape.materials.empty() && over != DrapedOver::flightgear)
    return fail(Errc::invalid_argument,
                "--materials is of FlightGear's scenery: add --format flightgear");
  if (!drape.materials.empty() && drape.land_cover.empty())
    return fail(Errc::invalid_argument,
                "--materials says what classes of land cover look like: add --land-cover");
  return {};
}

/// Which classes have no material; an error where that is all of them.
Result<void> check_materials(const DrapeInput& drape, const Draped& draped) {
  const auto materials = flightgear::class_materials(*draped.cover);
  std::vector<std::string> without;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const CoverClass& one = draped.cover->classes()[i];
    if (materials[i].empty())
      without.push_back(one.name.empty() ? fmt::format("{}", one.number)
                                         : fmt::format("{} ({})", one.number, one.name));
  }
  if (without.empty()) return {};
  constexpr std::size_t kShown = 8;
  const bool all = without.size() == materials.size(), more = without.size() > kShown;
  if (more) without.resize(kShown);
  const std::string classes = fmt::format("{}{}", fmt::join(without, ", "), more ? ", ..." : "");
  if (all)
    return fail(Errc::invalid_argument,
                fmt::format("{}: FlightGear has no material for any class ({}); say which with "
                            "--materials: worldcover, corine, or like {}=EvergreenForest",
                            drape.land_cover, classes, draped.cover->classes()[0].number));
  warn(
      fmt::format("{}: drawn as {}, since it is not said what FlightGear calls them (--materials): "
                  "{}",
                  drape.land_cover, flightgear::kLandMaterial, classes));
  return {};
}

}  // namespace

std::vector<std::string> DrapeInput::files() const {
  std::vector<std::string> names;
  for (const std::string& name : {image, land_cover})
    if (!name.empty()) names.push_back(name);
  return names;
}

void add_drape_options(Command c, DrapeInput& drape) {
  c.add_option("--drape", drape.image,
               "an image that says where it is (GeoTIFF): colours of the vertices of 3D Tiles; "
               "quantized-mesh has none. With --method attribute-qem vertices go where its edges "
               "are");
  c.add_option(
      "--land-cover", drape.land_cover,
      "a raster of classes that says where it is: each triangle of 3D Tiles is a feature of "
      "its class, with number, name and colour (EXT_mesh_features); of FlightGear's scenery it has "
      "the class's material");
  c.add_option("--materials", drape.materials,
               "how FlightGear draws classes of --land-cover: worldcover (ESA's), corine, or "
               "NUMBER=MATERIAL, several with commas between, like worldcover,10=EvergreenForest. "
               "Classes whose names are FlightGear's own need none");
}

Result<Draped> open_drape(const DrapeInput& drape, DrapedOver over) {
  if (auto fits = check_fits(drape, over); !fits) return std::unexpected(fits.error());
  auto materials = flightgear::parse_materials(drape.materials);
  if (!materials) return fail("--materials", materials.error());
  auto draped = open_draped(drape.image, drape.land_cover);
  if (!draped) return draped;
  if (draped->cover && !materials->empty())
    draped->cover = flightgear::with_materials(draped->cover, std::move(*materials));
  if (over == DrapedOver::flightgear && draped->cover)
    if (auto done = check_materials(drape, *draped); !done) return std::unexpected(done.error());
  return draped;
}

Result<void> check_drape(const DrapeInput& drape, const Draped& draped, const Surface& surface) {
  return check_lies_on(surface.info().bounds, draped, drape.image, drape.land_cover);
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
