#pragma once
// Encodes a tile as quantized-mesh-1.0 with all extensions that tind writes, and decodes any.

#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/tile/tile_model.h"

namespace tind {

/// Lossless: the format's integers are the model's. REQUIRES: normals and a certificate.
std::vector<std::uint8_t> encode_quantized_mesh(const TileModel&);

/// Any maker's tile, not compressed. bad_data with the reason in one line. Metadata of an unknown
/// kind count as none: they are no part of the format. Its list of descendants is not read.
/// GUARANTEES: what encode_quantized_mesh wrote comes back to the last bit.
Result<TileModel> decode_tile(TileId, std::span<const std::uint8_t>);

}  // namespace tind
