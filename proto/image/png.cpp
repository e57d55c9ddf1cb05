#include "proto/image/png.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdlib>
#include <string_view>

#include "terrain/base/bytes.h"
#include "terrain/base/deflate.h"

namespace tind::proto {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

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

/// `pixel`: bytes of one. A row's bytes are asked for when its turn has come.
template <class BytesOfRow>
std::string filtered(std::size_t width, std::size_t height, std::size_t pixel,
                     const BytesOfRow& bytes_of) {
  const std::size_t wide = width * pixel;
  Row above(wide + pixel), row(wide + pixel);
  std::string out, one, best;
  out.reserve(height * (wide + 1));
  for (std::size_t y = 0; y < height; ++y) {
    bytes_of(y, row.data() + pixel);
    std::uint64_t least = ~std::uint64_t(0);
    for (int type = 0; type < 5; ++type) {
      filter_row(type, pixel, above, row, one);
      if (const std::uint64_t w = weight(one); w < least) least = w, best.swap(one);
    }
    out += best;
    above.swap(row);
  }
  return out;
}

struct Head {
  int width, height;
  char bits, colour_type;
};

std::string file_of(const Head& h, std::string_view rows, const std::vector<PngText>& texts,
                    int level) {
  std::string head;
  put_u32(head, std::uint32_t(h.width));
  put_u32(head, std::uint32_t(h.height));
  head += {h.bits, h.colour_type, 0, 0, 0};
  std::string out(kSignature);
  put_chunk(out, "IHDR", head);
  for (const auto& [keyword, text] : texts) {
    std::string both = keyword;
    both += '\0';
    both += text;
    put_chunk(out, "tEXt", both);
  }
  put_chunk(out, "IDAT", deflate<std::string>(rows, Wrapping::zlib, level));
  put_chunk(out, "IEND", "");
  return out;
}

}  // namespace

std::string encode_png(int width, int height, int channels, std::span<const std::uint8_t> samples,
                       const std::vector<PngText>& texts, int level) {
  constexpr char kColourTypes[] = {0, 4, 2, 6};  // grey, grey and alpha, RGB, RGB and alpha
  const std::size_t wide = std::size_t(width) * std::size_t(channels);
  assert(channels >= 1 && channels <= 4 && samples.size() == wide * std::size_t(height));
  const auto rows = filtered(std::size_t(width), std::size_t(height), std::size_t(channels),
                             [&](std::size_t y, std::uint8_t* out) {
                               std::ranges::copy(samples.subspan(y * wide, wide), out);
                             });
  return file_of({width, height, 8, kColourTypes[channels - 1]}, rows, texts, level);
}

std::string encode_grey16_png(int width, int height, std::span<const std::uint16_t> samples,
                              const std::vector<PngText>& texts, int level) {
  const auto wide = std::size_t(width);
  assert(samples.size() == wide * std::size_t(height));
  const auto rows =
      filtered(wide, std::size_t(height), sizeof samples[0], [&](std::size_t y, std::uint8_t* out) {
        for (const std::uint16_t v : samples.subspan(y * wide, wide)) {
          store<std::endian::big>(v, out);
          out += sizeof v;
        }
      });
  return file_of({width, height, 16, 0}, rows, texts, level);
}

bool is_whole_png(std::string_view bytes) {
  constexpr std::size_t kAround = 12;  // of a chunk: length, type, checksum
  if (!bytes.starts_with(kSignature)) return false;
  bytes.remove_prefix(kSignature.size());
  for (bool first = true; bytes.size() >= kAround; first = false) {
    const std::size_t size = load<std::uint32_t, std::endian::big>(bytes.data());
    if (size > bytes.size() - kAround) return false;
    const std::string_view checked = bytes.substr(4, 4 + size), type = checked.substr(0, 4);
    if (load<std::uint32_t, std::endian::big>(bytes.data() + 8 + size) != crc32(checked))
      return false;
    if (first != (type == "IHDR")) return false;
    bytes.remove_prefix(kAround + size);
    if (type == "IEND") return size == 0 && bytes.empty();
  }
  return false;
}

}  // namespace tind::proto
