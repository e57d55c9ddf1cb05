#pragma once
// The beginning of a .tpm: its header and its base mesh (mesh_stream.h has the rest).

#include "proto/stream/mesh_stream.h"

namespace tind::proto {

/// Twice the area of abc seen from above; negative when clockwise.
inline std::int64_t orient(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  return (std::int64_t(b[0]) - a[0]) * (std::int64_t(c[1]) - a[1]) -
         (std::int64_t(b[1]) - a[1]) * (std::int64_t(c[0]) - a[0]);
}

/// Either way, of X (axis 0), Y or Z.
std::int64_t largest_coordinate(StreamFrame, int axis);

std::vector<std::uint8_t> encode_start(const MeshStream&);

/// Fills in everything but blocks and splits; the number of bytes taken.
Result<std::size_t> decode_start(std::span<const std::uint8_t>, MeshStream&);

}  // namespace tind::proto
