#pragma once
// Encoded polylines: places as printable text, each as the difference from the one before, in
// groups of five bits [Google: Encoded Polyline Algorithm Format]. Five digits after the point is
// the usual precision (1 m), six that of Valhalla and OSRM.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

/// Degrees; not checked: a stranger's may lie anywhere.
struct PolylinePlace {
  double lat = 0, lon = 0;
  friend bool operator==(const PolylinePlace&, const PolylinePlace&) = default;
};

/// invalid_argument for text that is none, that ends early, that has more than `most` places, or
/// one beyond a thousand degrees. `digits`: after the point. REQUIRES: 1 to 7.
Result<std::vector<PolylinePlace>> decode_polyline(std::string_view text, int digits,
                                                   std::size_t most);

/// Places are rounded to `digits`. REQUIRES: all within a thousand degrees.
std::string encode_polyline(std::span<const PolylinePlace>, int digits);

}  // namespace tind::proto
