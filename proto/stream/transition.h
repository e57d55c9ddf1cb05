#pragma once
// The way from a tile to its parent's part of the same area, on the wire (docs/formats.md): the
// parent's part as a mesh, and the vertex splits that lead to the tile. Plain numbers; what they
// mean is terrain/progressive/transition/terrain_transition.h.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

struct Transition {
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  std::uint32_t level = 0, x = 0, y = 0;  // the tile
  double coarse_error_m = 0, fine_error_m = 0;
  std::uint32_t border_splits = 0, fine_vertices = 0;
  std::vector<double> u, v, coarse_z, fine_z;           // by vertex: 0..32767, metres
  std::vector<std::array<std::uint32_t, 3>> triangles;  // of the parent's part
  std::vector<std::array<std::uint32_t, 3>> splits;     // vertex, left, right or kNone
};

std::vector<std::uint8_t> encode(const Transition&);

/// bad_data on bad bytes: every count is checked against the bytes that are
/// there, every index against the vertices that exist at that point, every number is finite.
Result<Transition> decode_transition(std::span<const std::uint8_t> bytes);

}  // namespace tind::proto
