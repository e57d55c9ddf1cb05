#pragma once
// Well-Known Text of geometries (OGC 06-103r4, 7) as clients write it into queries: places only, no
// curves, no collections.

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

enum class WktType { point, multi_point, line_string, multi_line_string, polygon, multi_polygon };

/// "LINESTRING", without Z or M.
std::string_view name(WktType);

using WktLine = std::vector<std::array<double, 2>>;  // x and y as they stand there

struct WktGeometry {
  WktType type = WktType::point;
  bool has_z = false, has_m = false;  // written, and dropped
  /// Points: one line of them in one part. Lines: in one part. Polygons: a part each, its rings.
  std::vector<std::vector<WktLine>> parts;
};

/// "POINT(7 46)", "LINESTRING Z (7 46 500, 8 47 600)", in any case. A plus sign between numbers is
/// a blank, as forms send it. invalid_argument where it is something else, says where it ends being
/// WKT, or what it is that may not be here: EMPTY, a line of one place, a ring that is not closed
/// or has fewer than four places, more places than `most`.
Result<WktGeometry> decode_wkt(std::string_view text, std::size_t most);

}  // namespace tind::proto
