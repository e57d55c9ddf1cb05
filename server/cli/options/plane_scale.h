#pragma once
// What commands say of a DEM whose projection has other lengths and areas than the ground.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "terrain/analysis/plane_scale.h"

namespace tind::cli {

// Each says on stderr by how much, where that is more than 1 %.

/// Of areas and volumes.
void warn_of_areas(const AreaScale&, const DemInfo&);
/// `what`: that is computed of lengths, "slopes are".
void warn_of_lengths(const LengthScale&, const DemInfo&, const std::string& what);
/// Of directions, which are those on the ground as long as all lengths of a place are off alike.
void warn_of_directions(const LengthScale&, const DemInfo&);

/// The same for reports.
nlohmann::ordered_json area_scale_json(const AreaScale&);
nlohmann::ordered_json length_scale_json(const LengthScale&);

}  // namespace tind::cli
