#include "proto/png.h"

#include <cassert>
#include <cstddef>
#include <string_view>

#include "terrain/base/bytes.h"
#include "terrain/base/deflate.h"

namespace tind::proto {
namespace {

void put_u32(std::string& out, std::uint32_t v) {
  out.resize(out.size() + sizeof v);
  store<std::endian::big>(v, out.data() + out.size() - sizeof v);
}

void put_chunk(std::string& out, std::string_view type, std::string_view data) {
  put_u32(out, std::uint32_t(data.size()));
  const std::size_t start = out.size();
  out += type;
  out += data;
  put_u32(out, crc32(std::string_view(out).substr(start)));
}

}  // namespace

std::string encode_png(int width, int height, int channels, std::span<const std::uint8_t> samples) {
  const std::size_t row = std::size_t(width) * std::size_t(channels);
  assert((channels == 1 || channels == 3) && samples.size() == row * std::size_t(height));
  std::string raw;
  raw.reserve(std::size_t(height) * (row + 1));
  for (std::size_t begin = 0; begin < samples.size(); begin += row) {
    raw += '\2';  // filter: difference to the pixel above
    for (std::size_t i = begin; i < begin + row; ++i)
      raw += char(samples[i] - (begin > 0 ? samples[i - row] : 0));
  }
  std::string head;
  put_u32(head, std::uint32_t(width));
  put_u32(head, std::uint32_t(height));
  head += {'\x08', char(channels == 3 ? 2 : 0), 0, 0, 0};  // 8 bits, RGB or grey
  std::string out = "\x89PNG\r\n\x1a\n";
  put_chunk(out, "IHDR", head);
  put_chunk(out, "IDAT", deflate<std::string>(raw, Wrapping::zlib, 9));
  put_chunk(out, "IEND", "");
  return out;
}

}  // namespace tind::proto
