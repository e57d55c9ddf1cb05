#pragma once
// The three codecs of EXT_meshopt_compression (glTF), as their bytes stand in a buffer view. By the
// library of whoever thought them out, meshoptimizer.

#include <cstdint>
#include <span>
#include <vector>

namespace tind::proto::meshopt {

/// Mode ATTRIBUTES: vertices of `stride` bytes each, one behind the other. Lossless.
/// REQUIRES: `stride` a multiple of 4, at most 256.
std::vector<std::uint8_t> encode_vertices(std::span<const std::uint8_t> bytes, std::size_t stride);

/// Mode TRIANGLES: the same triangles in the same order; which corner comes first may change.
/// REQUIRES: threes of indices below `vertices`.
std::vector<std::uint8_t> encode_triangles(std::span<const std::uint32_t> indices,
                                           std::size_t vertices);

/// Mode INDICES: any sequence, lossless. REQUIRES: indices below `vertices`.
std::vector<std::uint8_t> encode_indices(std::span<const std::uint32_t> indices,
                                         std::size_t vertices);

}  // namespace tind::proto::meshopt
