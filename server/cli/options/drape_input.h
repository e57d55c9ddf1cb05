#pragma once
// What a command line lays over 3D Tiles or FlightGear's scenery: an image, land cover; and over
// the posts of a DEM.

#include <memory>
#include <string>
#include <vector>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/draped.h"
#include "terrain/raster/gdal/pictures/image_source.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

struct DrapeInput {
  std::string image, land_cover, materials;  // empty: none

  std::vector<std::string> files() const;
};

void add_drape_options(Command, DrapeInput&);

enum class DrapedOver { nothing, tiles3d, flightgear };

/// Before any work. Fails (invalid_argument) where something is asked for that what is made cannot
/// have, where no class has a material of FlightGear's, and as opening does. Of FlightGear's
/// scenery it says on stderr which classes have none.
Result<Draped> open_drape(const DrapeInput&, DrapedOver);
/// Fails (invalid_argument) where something lies beside the surface.
Result<void> check_drape(const DrapeInput&, const Draped&, const Surface&);

/// A colour of the image for each post, as AttributeQemOptions has it; says on stderr which share
/// of the DEM has none and is white. Fails as drape_image does.
Result<std::shared_ptr<const std::vector<Colour>>> drape_posts(const std::string& image,
                                                               const DemSource&);

}  // namespace tind::cli
