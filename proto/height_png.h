#pragma once
// Heights as colours of a PNG, in the two ways that web maps know: terrain-RGB (Mapbox) and
// terrarium (Tilezen). No alpha: browsers multiply it into the colours.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/png.h"

namespace tind::proto {

enum class HeightCode {
  mapbox,    // -10000 + (R 65536 + G 256 + B) / 10
  terrarium  // R 256 + G + B / 256 - 32768
};

/// As TileJSON has it in "encoding"; nothing for other words.
std::optional<HeightCode> height_code_named(std::string_view);
std::string_view name(HeightCode);

/// Metres between two heights that it can say.
double height_step_m(HeightCode);

/// The nearest height that it can say; what is beyond its range becomes the end of that.
std::array<std::uint8_t, 3> height_colour(double metres, HeightCode);
double height_of(std::array<std::uint8_t, 3> colour, HeightCode);

/// A square of heights, rows from the north. REQUIRES: pixels * pixels heights, all finite.
std::string encode_height_png(int pixels, std::span<const float> heights, HeightCode,
                              const std::vector<PngText>& texts = {});

}  // namespace tind::proto
