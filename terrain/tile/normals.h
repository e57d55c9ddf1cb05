#pragma once
// Surface normals in the form that globe clients read: unit vectors in ecef, two bytes each
// (octahedral encoding, [Cigolle14]).

#include <array>
#include <cstdint>

#include "terrain/geo/coordinates.h"

namespace tind {

/// Bytes 0..255 for -1..1, rounded half up, as CesiumJS's AttributeCompression.octEncode does it.
/// Within 0.95 degrees of the vector. REQUIRES: not the zero vector.
std::array<std::uint8_t, 2> oct_encode(const Vec3& unit);

/// A unit vector.
Vec3 oct_decode(std::array<std::uint8_t, 2>);

/// The upward unit normal in ecef of a surface that at `p` rises by `dz_dx_east` metres per metre
/// to the east and `dz_dy_north` to the north.
Vec3 ecef_normal(Geographic p, double dz_dx_east, double dz_dy_north);

}  // namespace tind
