#include "proto/png.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdlib>
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

int paeth(int left, int up, int corner) {
  const int guess = left + up - corner;
  const int a = std::abs(guess - left), b = std::abs(guess - up), c = std::abs(guess - corner);
  return a <= b && a <= c ? left : b <= c ? up : corner;
}

using Row = std::vector<std::uint8_t>;

/// 9.2 of the standard. Both rows begin with a pixel of zeros, which stands left of them.
void filter_row(int type, std::size_t pixel, const Row& above, const Row& row, std::string& out) {
  out.assign(1, char(type));
  for (std::size_t i = pixel; i < row.size(); ++i) {
    const int left = row[i - pixel], up = above[i], corner = above[i - pixel];
    const int guess = type == 0   ? 0
                      : type == 1 ? left
                      : type == 2 ? up
                      : type == 3 ? (left + up) / 2
                                  : paeth(left, up, corner);
    out += char(row[i] - guess);
  }
}

std::uint64_t weight(std::string_view filtered) {
  std::uint64_t sum = 0;
  for (const char c : filtered.substr(1))
    sum += std::uint64_t(std::abs(int(static_cast<signed char>(c))));
  return sum;
}

std::string filtered(std::size_t width, std::size_t channels,
                     std::span<const std::uint8_t> samples) {
  const std::size_t wide = width * channels;
  Row above(wide + channels), row(wide + channels);
  std::string out, one, best;
  out.reserve(samples.size() + samples.size() / wide);
  for (std::size_t begin = 0; begin < samples.size(); begin += wide) {
    std::copy_n(samples.begin() + long(begin), wide, row.begin() + long(channels));
    std::uint64_t least = ~std::uint64_t(0);
    for (int type = 0; type < 5; ++type) {
      filter_row(type, channels, above, row, one);
      if (const std::uint64_t w = weight(one); w < least) least = w, best.swap(one);
    }
    out += best;
    above.swap(row);
  }
  return out;
}

}  // namespace

std::string encode_png(int width, int height, int channels, std::span<const std::uint8_t> samples,
                       const std::vector<PngText>& texts, int level) {
  assert((channels == 1 || channels == 3) &&
         samples.size() == std::size_t(width) * std::size_t(channels) * std::size_t(height));
  std::string head;
  put_u32(head, std::uint32_t(width));
  put_u32(head, std::uint32_t(height));
  head += {'\x08', char(channels == 3 ? 2 : 0), 0, 0, 0};  // 8 bits, RGB or grey
  std::string out = "\x89PNG\r\n\x1a\n";
  put_chunk(out, "IHDR", head);
  for (const auto& [keyword, text] : texts) put_chunk(out, "tEXt", keyword + '\0' + text);
  put_chunk(out, "IDAT",
            deflate<std::string>(filtered(std::size_t(width), std::size_t(channels), samples),
                                 Wrapping::zlib, level));
  put_chunk(out, "IEND", "");
  return out;
}

}  // namespace tind::proto
