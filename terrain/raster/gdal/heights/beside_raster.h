#pragma once
// Files that GDAL looks for beside a raster and reads unasked. What it cannot open or read is for
// it not there, and the raster then has other heights, at other places.

#include <filesystem>

#include "terrain/base/result.h"

namespace tind::gdal {

/// Before it is opened. bad_data for a pipe or a device of such a name, which would be waited for
/// without end; io for what changes heights or places and cannot be opened.
Result<void> look_beside(const std::filesystem::path& raster);

/// Of a raster that GDAL found no place of. Fails where a world file is beside it: io, or bad_data
/// where that is none, unless it says what a raster without one has, too.
Result<void> no_world_file(const std::filesystem::path& raster);

}  // namespace tind::gdal
