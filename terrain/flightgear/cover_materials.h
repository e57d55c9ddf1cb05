#pragma once
// What FlightGear draws classes of land cover with: the names of its materials.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/land_cover.h"

namespace tind::flightgear {

/// Of land of which nothing more is known, and of water.
inline constexpr const char* kLandMaterial = "Default";
inline constexpr const char* kWaterMaterial = "Lake";

using Materials = std::map<std::uint16_t, std::string>;  // by the number of a class

/// "worldcover,95=Marsh": classes as NUMBER=MATERIAL, and schemes, each for all its classes:
/// worldcover, of ESA WorldCover; corine, of CORINE Land Cover, by its codes (111 to 523) and by
/// the numbers that its rasters have in their place (1 to 44). Commas between; what comes later
/// wins. Whether FlightGear has a material of that name, it alone knows. invalid_argument: anything
/// else.
Result<Materials> parse_materials(std::string_view);

/// The same land cover, which also knows what of its classes has been said: for class_materials().
/// REQUIRES: not null.
std::shared_ptr<const LandCover> with_materials(std::shared_ptr<const LandCover>, Materials said);

/// Of each of the raster's classes, in their order: as said by with_materials(); of one that is not
/// named there, the class's own name where FlightGear's scenery has land of that name; else none
/// (empty).
std::vector<std::string> class_materials(const LandCover&);

/// Another where pixels or materials are others: 32 digits.
std::string digest_of(const LandCover&);

}  // namespace tind::flightgear
