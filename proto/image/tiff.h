#pragma once
// TIFF 6.0 as tind's own files have it: which of them are whole. They are written and read by GDAL
// (terrain/raster/gdal/).

#include <string_view>

namespace tind::proto {

/// Is it a little-endian TIFF whose first image is all there: its directory, the values that this
/// leads to, and each strip or tile? So of what was cut off something is missing; bytes that were
/// changed are not found, for the format has no checksums. Costs a look at each strip's place.
bool is_whole_tiff(std::string_view bytes);

}  // namespace tind::proto
