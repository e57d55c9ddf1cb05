#pragma once
// quantized-mesh-1.0: the wire format of globe terrain tiles, as plain numbers and bytes.
// (CesiumGS/quantized-mesh specification; the rules that others get wrong are listed in
// docs/formats.md.) No geometry here: the caller gives every number of the header.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

struct QuantizedMesh {
  std::array<double, 3> center{};                        // ecef, metres
  float min_height = 0, max_height = 0;                  // metres above the ellipsoid
  std::array<double, 4> bounding_sphere{};               // ecef centre and radius, metres
  std::array<double, 3> horizon_occlusion{};             // ellipsoid-scaled ecef
  std::vector<std::uint16_t> u, v, h;                    // 0..32767; u east, v north
  std::vector<std::array<std::uint32_t, 3>> triangles;   // counter-clockwise
  std::vector<std::uint32_t> west, south, east, north;   // vertices on each side
  std::vector<std::array<std::uint8_t, 2>> oct_normals;  // extension 1; empty: absent
  std::vector<std::uint8_t> water_mask;                  // extension 2: 1 or 65536 bytes; or absent
  std::string metadata;                                  // extension 4, JSON text; empty: absent
};

/// Puts vertices into first-use order of the triangles (which the high-water-mark code needs),
/// fills the four edge lists sorted (W south to north, S east to west, E north to south, N west to
/// east), and drops vertices that no triangle uses. Deterministic.
void arrange(QuantizedMesh&);

/// Where the header has max_height.
inline constexpr std::size_t kMaxHeightAt = 28;

/// Bytes. REQUIRES: arranged. 32-bit indices iff more than 65536 vertices, padded as specified.
std::vector<std::uint8_t> encode(const QuantizedMesh&);

/// Any maker's tile: strict about sizes and ranges, skips unknown extensions by their length,
/// accepts legacy big-endian `vertexnormals` lengths. bad_data on bad bytes.
/// Never reads outside `bytes`; allocates at most about 20 times their size.
Result<QuantizedMesh> decode(std::span<const std::uint8_t> bytes);

/// Which extensions to keep, from any client's way of asking.
struct Extensions {
  bool normals = false, water_mask = false, metadata = false;
  friend bool operator==(const Extensions&, const Extensions&) = default;
};

/// The same tile without the extensions that were not asked for: a copy of bytes, no re-encoding.
/// REQUIRES: bytes that decode() accepts (others come back unchanged).
std::vector<std::uint8_t> strip_extensions(std::span<const std::uint8_t> bytes, Extensions keep);

}  // namespace tind::proto
