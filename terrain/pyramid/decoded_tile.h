#pragma once
// A finished tile as a client reads it, with what it says of itself.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

struct DecodedTile {
  Tin mesh;              // x = u, y = v (0..32767), z in metres above the ellipsoid
  double range_m = 0;    // highest - lowest height of its header: 32767 steps
  struct Statement {     // tind's metadata
    double max_error_m;  // >= 0
    double edge_error_m = 0;
    bool exact = false;
    std::string side = "both";
  };
  std::optional<Statement> says;  // none: the tile states no error
};

/// Any maker's quantized-mesh tile, not compressed. bad_data with the reason in one line. Metadata
/// of an unknown kind counts as none: it is no part of the format.
Result<DecodedTile> decode_tile(std::span<const std::uint8_t>);

}  // namespace tind
