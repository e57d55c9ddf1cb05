#pragma once
// The part of `tind info` that is about the layers which several DEMs make.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

/// What the numbers of a DEM's first file are, as --json has it: type, band, scale, offset, nodata.
Result<nlohmann::ordered_json> content_json(const std::string& path, const DemOptions&);
/// The same in words.
std::string content_text(const nlohmann::ordered_json&);

/// The layers of a surface, the lowest first: name, files, CRS, spacing, bounds, datum, accuracy,
/// and what the numbers of the first file are.
Result<nlohmann::ordered_json> layers_json(const Surface&, const DemOptions&);
/// A table of them, the topmost first.
std::string layers_table(const nlohmann::ordered_json& layers);

}  // namespace tind::cli
