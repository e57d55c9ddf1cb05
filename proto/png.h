#pragma once
// PNG (ISO/IEC 15948), 8 bits a channel, as it is written.

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tind::proto {

/// Keyword and text of a tEXt chunk; Latin-1.
using PngText = std::pair<std::string, std::string>;

/// `samples`: rows from the top, of width x channels bytes. Each row has the filter with the
/// smallest sum of differences (the standard's heuristic, 12.8); the same bytes on every machine.
/// `level`: of DEFLATE, 1..12. REQUIRES: 1 channel (grey) or 3 (RGB); as many samples as that
/// makes.
std::string encode_png(int width, int height, int channels, std::span<const std::uint8_t> samples,
                       const std::vector<PngText>& texts = {}, int level = 9);

}  // namespace tind::proto
