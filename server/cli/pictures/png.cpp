#include "server/cli/pictures/png.h"

#include <string_view>

#include "terrain/base/deflate.h"

namespace tind::cli {

namespace {

void put_u32(std::string& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out += char(v >> shift);
}

void put_chunk(std::string& out, std::string_view type, std::string_view data) {
  put_u32(out, std::uint32_t(data.size()));
  const std::size_t start = out.size();
  out += type;
  out += data;
  put_u32(out, crc32(std::string_view(out).substr(start)));
}

std::string base64(std::string_view in) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(in.size() * 4 / 3 + 4);
  for (std::size_t i = 0; i < in.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, in.size() - i);
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k) v = v << 8 | (k < n ? std::uint8_t(in[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= n ? kDigits[v >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

}  // namespace

std::string encode_png(const Picture& picture) {
  std::string raw;
  raw.reserve(std::size_t(picture.height) * (3 * std::size_t(picture.width) + 1));
  for (int y = 0; y < picture.height; ++y) {
    raw += '\2';  // filter: difference to the pixel above
    for (int x = 0; x < picture.width; ++x) {
      const std::size_t i = std::size_t(y) * picture.width + x;
      for (int k = 0; k < 3; ++k) {
        const int above = y > 0 ? picture.pixels[i - picture.width][k] : 0;
        raw += char(picture.pixels[i][k] - above);
      }
    }
  }
  std::string head;
  put_u32(head, std::uint32_t(picture.width));
  put_u32(head, std::uint32_t(picture.height));
  head += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, RGB
  std::string out = "\x89PNG\r\n\x1a\n";
  put_chunk(out, "IHDR", head);
  put_chunk(out, "IDAT", deflate<std::string>(raw, Wrapping::zlib, 9));
  put_chunk(out, "IEND", "");
  return out;
}

std::string png_data_uri(const Picture& picture) {
  return "data:image/png;base64," + base64(encode_png(picture));
}

}  // namespace tind::cli
