#pragma once
// Quadrilaterals of mesh files as triangles.

#include <array>
#include <cstdint>
#include <span>

namespace tind::proto {

/// Two triangles in the order of the corners, parted by the diagonal from the first one, or by the
/// other where only that lies inside, as seen from above. REQUIRES: corners of `positions`.
inline std::array<std::array<std::uint32_t, 3>, 2> split_quad(
    std::span<const std::array<double, 3>> positions, const std::array<std::uint32_t, 4>& q) {
  const auto turn = [&](std::size_t i, std::size_t j, std::size_t k) {
    const auto &a = positions[q[i]], &b = positions[q[j]], &c = positions[q[k]];
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  };
  const bool first_inside = turn(0, 1, 2) * turn(0, 2, 3) >= 0;
  if (first_inside) return {{{q[0], q[1], q[2]}, {q[0], q[2], q[3]}}};
  return {{{q[1], q[2], q[3]}, {q[1], q[3], q[0]}}};
}

}  // namespace tind::proto
