#pragma once
// PNG (ISO/IEC 15948), 8 bits a channel, as it is written.

#include <cstdint>
#include <span>
#include <string>

namespace tind::proto {

/// `samples`: rows from the top, of width x channels bytes. Filtered by `up` and deflated: the same
/// bytes on every machine. REQUIRES: 1 channel (grey) or 3 (RGB); as many samples as that makes.
std::string encode_png(int width, int height, int channels, std::span<const std::uint8_t> samples);

}  // namespace tind::proto
