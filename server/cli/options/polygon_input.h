#pragma once
// Polygons of a vector file over a DEM, for commands that measure inside them.

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

}  // namespace tind::cli
