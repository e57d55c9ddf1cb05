#pragma once
// Many tiles in one response (docs/formats.md): a frame for every tile that was asked for, in that
// order, whether it is there or not.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

struct TileFrame {
  std::uint32_t level = 0, x = 0, y = 0;
  std::uint32_t status = 200;  // as HTTP would have said for this tile alone; 413: beyond the limit
  std::span<const std::uint8_t> bytes;  // of the tile; empty unless status is 200
};

/// The head of a response with `count` frames; frames are appended.
std::vector<std::uint8_t> begin_frames(std::uint32_t count);
void append_frame(std::vector<std::uint8_t>&, const TileFrame&);
/// All of a frame but its tile's bytes, for who sends those from elsewhere: kFrameHead bytes.
void append_frame_head(std::vector<std::uint8_t>&, const TileFrame&);
constexpr std::size_t kFramesHead = 12, kFrameHead = 20;

/// Views into `bytes`. bad_data when they are not exactly such a response.
Result<std::vector<TileFrame>> decode_frames(std::span<const std::uint8_t> bytes);

}  // namespace tind::proto
