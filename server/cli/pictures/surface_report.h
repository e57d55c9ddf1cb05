#pragma once
// How `tind simplify` and `tind measure` report the distance of two surfaces.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "terrain/mesh/surface_distance.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/options.h"

namespace tind::cli {

/// max, rms (in the meshes' units and as a share of the diagonal), both sides, attribute errors.
nlohmann::ordered_json distance_json(const SurfaceDistance&);

/// How far the attributes (and, in three dimensions, the surface) of a simplified DEM are from
/// those of its full mesh; nothing for methods that carry none. `made` is in post coordinates.
std::optional<SurfaceDistance> attribute_errors(const SimplifyOptions&, const Terrain& dem,
                                                const Tin& made);

/// A few lines for a person.
std::string distance_text(const SurfaceDistance&);

}  // namespace tind::cli
