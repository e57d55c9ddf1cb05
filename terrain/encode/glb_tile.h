#pragma once
// Encodes a tile as GLB (binary glTF): positions around its centre, normals, error in `extras`.

#include <cstdint>
#include <vector>

#include "terrain/tile/tile_model.h"

namespace tind {

/// Positions are float, relative to a centre in double: what that rounds off is part of the
/// max_error_m that the node's extras state. Neighbours have other centres, so at their common edge
/// they agree to that rounding (`rounding_m`), not to the bit.
std::vector<std::uint8_t> encode_glb(const TileModel&);

}  // namespace tind
