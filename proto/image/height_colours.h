#pragma once
// Heights as colours of an image, in the two ways that web maps know: terrain-RGB (Mapbox) and
// terrarium (Tilezen). No alpha: browsers multiply it into the colours.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

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

/// The nearest height that it can say; what is beyond its range becomes the end of that. The lowest
/// of terrain-RGB, black, is what many take for no data: what is as low becomes the next one.
std::array<std::uint8_t, 3> height_colour(double metres, HeightCode);
double height_of(std::array<std::uint8_t, 3> colour, HeightCode);

/// How far the farthest of these lies beyond what it can say; 0: none does. REQUIRES: all finite.
double beyond_range_m(std::span<const float> heights, HeightCode);

/// Red, green, blue of each. REQUIRES: all finite.
std::vector<std::uint8_t> height_colours(std::span<const float> heights, HeightCode);

}  // namespace tind::proto
