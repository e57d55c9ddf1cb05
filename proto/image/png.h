#pragma once
// PNG (ISO/IEC 15948) as it is written: 8 bits a channel, or grey of 16.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tind::proto {

/// Keyword and text of a tEXt chunk; Latin-1.
using PngText = std::pair<std::string, std::string>;

/// `samples`: rows from the top, of width x channels bytes. Each row has the filter with the
/// smallest sum of differences (the standard's heuristic, 12.8); the same bytes on every machine.
/// `level`: of DEFLATE, 1..12. REQUIRES: 1 channel (grey), 2 (and alpha), 3 (RGB) or 4 (and alpha);
/// as many samples as that makes.
std::string encode_png(int width, int height, int channels, std::span<const std::uint8_t> samples,
                       const std::vector<PngText>& texts = {}, int level = 9);

/// Grey of 16 bits; all else as above. REQUIRES: width x height samples.
std::string encode_grey16_png(int width, int height, std::span<const std::uint16_t> samples,
                              const std::vector<PngText>& texts = {}, int level = 9);

/// Is it one PNG from beginning to end, with the right checksum in each of its chunks? What was cut
/// off or changed is not; what the chunks hold is not looked at.
bool is_whole_png(std::string_view bytes);

}  // namespace tind::proto
