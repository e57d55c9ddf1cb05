#include "proto/tile_frames.h"

#include <array>

namespace tind::proto {

namespace {

constexpr std::uint32_t kMagic = 0x53544e54;  // "TNTS"
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHead = 12, kFrameHead = 20;

void put(std::vector<std::uint8_t>& out, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(std::uint8_t(value >> shift));
}

std::uint32_t get(std::span<const std::uint8_t>& in) {
  const std::uint32_t value = std::uint32_t(in[0]) | std::uint32_t(in[1]) << 8 |
                              std::uint32_t(in[2]) << 16 | std::uint32_t(in[3]) << 24;
  in = in.subspan(4);
  return value;
}

}  // namespace

std::vector<std::uint8_t> begin_frames(std::uint32_t count) {
  std::vector<std::uint8_t> out;
  for (const std::uint32_t value : {kMagic, kVersion, count}) put(out, value);
  return out;
}

void append_frame(std::vector<std::uint8_t>& out, const TileFrame& f) {
  for (const std::uint32_t value : {f.level, f.x, f.y, f.status, std::uint32_t(f.bytes.size())})
    put(out, value);
  out.insert(out.end(), f.bytes.begin(), f.bytes.end());
}

std::optional<std::vector<TileFrame>> decode_frames(std::span<const std::uint8_t> bytes,
                                                    std::string& error) {
  const auto bad = [&](const char* why) {
    error = why;
    return std::nullopt;
  };
  if (bytes.size() < kHead) return bad("shorter than its head");
  if (get(bytes) != kMagic) return bad("not tiles in frames");
  if (get(bytes) != kVersion) return bad("an unknown version");
  const std::uint32_t count = get(bytes);
  std::vector<TileFrame> frames;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (bytes.size() < kFrameHead) return bad("a frame is cut off");
    TileFrame f;
    f.level = get(bytes), f.x = get(bytes), f.y = get(bytes), f.status = get(bytes);
    const std::uint32_t length = get(bytes);
    if (length > bytes.size()) return bad("a tile is cut off");
    f.bytes = bytes.first(length);
    bytes = bytes.subspan(length);
    frames.push_back(f);
  }
  if (!bytes.empty()) return bad("bytes are left over");
  return frames;
}

}  // namespace tind::proto
