#pragma once
// Polygons of a vector file over a DEM, for commands that measure inside them.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "terrain/analysis/area_integral.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind::cli {

/// The polygons of one feature of a file: a place is inside when it is in an odd number of rings.
struct NamedArea {
  std::size_t feature = 0;  // from 0, in the file's order
  PostRings rings;          // in the DEM's post coordinates
};

/// One a feature that has polygons. Fails as read_vectors() does, and (bad_data) for a file without
/// polygons.
Result<std::vector<NamedArea>> read_areas(const std::string& path, const DemSource&);

/// Says on stderr by how much areas and volumes in the plane of the DEM's projection differ from
/// those on the ground, where that is more than 1 %.
void warn_of_plane(const AreaScale&, const DemInfo&);

/// The same for reports.
nlohmann::ordered_json area_scale_json(const AreaScale&);

}  // namespace tind::cli
