#pragma once
// Lines on the globe as GeoJSON wants them.

#include <span>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

struct LinePoint {
  Geographic place;
  double height_m;  // NaN: none
};
using HeightLine = std::vector<LinePoint>;

/// The line cut where it crosses the antimeridian, with a point on each side (RFC 7946, section
/// 3.1.9): at least one part. REQUIRES: longitudes from -180 to 180.
std::vector<HeightLine> line_parts(std::span<const LinePoint>);

/// Whether all points have heights. Readers take a missing third number among others for 0: a line
/// with a void has its heights beside it.
bool has_all_heights(std::span<const LinePoint>);

}  // namespace tind
