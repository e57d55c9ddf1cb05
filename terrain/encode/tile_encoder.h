#pragma once
// The table of tile formats. To add a format, add a file to this folder and a row to the table.

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "terrain/tile/tile_model.h"

namespace tind {

/// An encoder is a function of the model alone, so its bytes are the same wherever they are made.
struct TileEncoder {
  std::string_view name;        // "quantized-mesh"
  std::string_view media_type;  // "application/vnd.quantized-mesh"
  std::string_view extension;   // of files and addresses, without a dot: "terrain"
  std::vector<std::uint8_t> (*encode)(const TileModel&);
};

/// quantized-mesh first: what stores hold, and what every other encoding can be made of.
std::span<const TileEncoder> tile_encoders();

/// Null when no format has that extension.
const TileEncoder* encoder_of_extension(std::string_view extension);

}  // namespace tind
