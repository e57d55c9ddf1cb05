#pragma once
// Rasters that look like DEMs and are none, and DEMs that look like geoids.

#include <string>

#include "terrain/base/result.h"

namespace tind {

/// Does a GeoTIFF say of itself, as PROJ's do, that its numbers are offsets: a geoid, a shift of
/// datums? False where it cannot be read.
bool is_offset_grid(const std::string& path);

/// No geoid is farther from the ellipsoid than 107 m.
inline constexpr double kMostUndulation_m = 200;

/// Can the grid (.gtx, .tif) be a geoid? One that says what it is, as PROJ's do, is taken at its
/// word; of any other 32 x 32 values at most, spread over it, are read. bad_data where it is
/// something else; what GDAL cannot read is left to who opens it.
Result<void> may_be_geoid(const std::string& path);

}  // namespace tind
