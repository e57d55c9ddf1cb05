#pragma once
// The colours that all pictures share: land by height, light and shade, differences.

#include <array>
#include <cstdint>

#include "terrain/geo/coordinates.h"

namespace tind::cli {

using Pixel = std::array<std::uint8_t, 3>;

/// t of the way from a to b.
Pixel mix(const Pixel& a, const Pixel& b, double t);

/// Land colours from low (0) to high (1), pale enough to carry the shading.
Pixel land(double t);

/// White within a twentieth, blue below (-1), red above (1).
Pixel difference(double t);

/// Light from the north-west, 45 degrees up, on a surface with this normal (x east, y north, any
/// length): 0..1, flat land has 0.71.
double light_on(const Vec3& normal);

/// A colour in so much light.
Pixel lit(const Pixel&, double light);

}  // namespace tind::cli
