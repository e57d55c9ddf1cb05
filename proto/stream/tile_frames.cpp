#include "proto/stream/tile_frames.h"

#include "terrain/base/bytes.h"

namespace tind::proto {

namespace {

constexpr std::uint32_t kMagic = 0x53544e54;  // "TNTS"
constexpr std::uint32_t kVersion = 1;

}  // namespace

std::vector<std::uint8_t> begin_frames(std::uint32_t count) {
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  for (const std::uint32_t value : {kMagic, kVersion, count}) out.put(value);
  return bytes;
}

void append_frame_head(std::vector<std::uint8_t>& bytes, const TileFrame& f) {
  ByteWriter out(bytes);
  for (const std::uint32_t value : {f.level, f.x, f.y, f.status, std::uint32_t(f.bytes.size())})
    out.put(value);
}

void append_frame(std::vector<std::uint8_t>& bytes, const TileFrame& f) {
  append_frame_head(bytes, f);
  bytes.insert(bytes.end(), f.bytes.begin(), f.bytes.end());
}

Result<std::vector<TileFrame>> decode_frames(std::span<const std::uint8_t> bytes) {
  const auto bad = [](const char* why) { return fail(Errc::bad_data, why); };
  ByteReader in(bytes);
  if (in.left() < kFramesHead) return bad("shorter than its head");
  const auto number = [&] { return in.get<std::uint32_t>(); };
  if (number() != kMagic) return bad("not tiles in frames");
  if (number() != kVersion) return bad("an unknown version");
  const std::uint32_t count = number();
  std::vector<TileFrame> frames;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (in.left() < kFrameHead) return bad("a frame is cut off");
    TileFrame f;
    f.level = number(), f.x = number(), f.y = number(), f.status = number();
    const std::uint32_t length = number();
    if (length > in.left()) return bad("a tile is cut off");
    f.bytes = in.get_bytes(length);
    frames.push_back(f);
  }
  if (in.left() > 0) return bad("bytes are left over");
  return frames;
}

}  // namespace tind::proto
