#pragma once
// How `tind simplify` and `tind measure` report the distance of two surfaces.

#include <nlohmann/json.hpp>
#include <string>

#include "terrain/mesh/surface_distance.h"

namespace tind::cli {

/// max, rms (in the meshes' units and as a share of the diagonal), both sides, attribute errors.
nlohmann::ordered_json distance_json(const SurfaceDistance&);

/// A few lines for a person.
std::string distance_text(const SurfaceDistance&);

}  // namespace tind::cli
