#include "proto/image/png.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <vector>

#include "terrain/base/bytes.h"
#include "terrain/base/deflate.h"

namespace tind::proto {
namespace {

/// Reads by the standard's text; fails the test where a length or a checksum
/// does not fit.
struct Decoded {
  std::uint32_t width = 0, height = 0;
  int bits = 0, colour = 0;
  std::vector<std::uint8_t> samples;
};

std::uint32_t big(ByteReader& in) {
  std::uint32_t v = 0;
  for (int i = 0; i < 4; ++i) v = v << 8 | in.get<std::uint8_t>();
  return v;
}

Decoded decode(const std::string& png) {
  Decoded decoded;
  ByteReader in(png);
  EXPECT_EQ(in.get_text(8), "\x89PNG\r\n\x1a\n");
  std::string packed, type;
  while (type != "IEND" && in.good()) {
    const std::uint32_t size = big(in);
    const std::string_view checked = in.get_text(4 + size);
    EXPECT_EQ(big(in), crc32(checked));
    type = checked.substr(0, 4);
    ByteReader data(checked.substr(4));
    if (type == "IHDR") {
      decoded.width = big(data), decoded.height = big(data);
      decoded.bits = data.get<std::uint8_t>(), decoded.colour = data.get<std::uint8_t>();
    }
    if (type == "IDAT") packed += checked.substr(4);
  }
  EXPECT_TRUE(in.good());
  EXPECT_EQ(in.left(), 0u);
  const auto raw = inflate(packed, Wrapping::zlib, 1 << 20);
  EXPECT_TRUE(raw);
  constexpr std::size_t kChannels[] = {1, 0, 3, 0, 2, 0, 4};  // by colour type
  const std::size_t pixel = kChannels[decoded.colour] * std::size_t(decoded.bits) / 8,
                    row = decoded.width * pixel;
  EXPECT_EQ(raw->size(), decoded.height * (row + 1));
  for (std::size_t y = 0; y < decoded.height; ++y) {
    const int filter = (*raw)[y * (row + 1)];
    EXPECT_LE(filter, 4);
    for (std::size_t i = 0; i < row; ++i) {
      const auto at = [&](std::size_t rows, std::size_t left) {
        return y >= rows && i >= left ? int(decoded.samples[(y - rows) * row + i - left]) : 0;
      };
      const int a = at(0, pixel), b = at(1, 0), c = at(1, pixel);
      const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
      const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
      const int guesses[] = {0, a, b, (a + b) / 2, paeth};
      decoded.samples.push_back(std::uint8_t((*raw)[y * (row + 1) + 1 + i] + guesses[filter]));
    }
  }
  return decoded;
}

TEST(Png, KeepsGreyAndColours) {
  for (const int channels : {1, 2, 3, 4})
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(5, 3), std::pair(3, 200)}) {
      std::vector<std::uint8_t> samples;
      for (int i = 0; i < width * height * channels; ++i)
        samples.push_back(std::uint8_t(i * i + 7 * i));
      const Decoded back = decode(encode_png(width, height, channels, samples));
      EXPECT_EQ(back.width, std::uint32_t(width));
      EXPECT_EQ(back.height, std::uint32_t(height));
      EXPECT_EQ(back.bits, 8);
      EXPECT_EQ(back.colour, (std::array<int, 4>{0, 4, 2, 6}[std::size_t(channels - 1)]));
      EXPECT_EQ(back.samples, samples);
    }
}

TEST(Png, KeepsGreyOf16Bits) {
  std::vector<std::uint16_t> samples;
  for (int i = 0; i < 37 * 21; ++i) samples.push_back(std::uint16_t(i * i * 31 + 7 * i));
  const std::string png = encode_grey16_png(37, 21, samples);
  EXPECT_TRUE(is_whole_png(png));
  const Decoded back = decode(png);
  EXPECT_EQ(back.width, 37u);
  EXPECT_EQ(back.height, 21u);
  EXPECT_EQ(back.bits, 16);
  EXPECT_EQ(back.colour, 0);
  ASSERT_EQ(back.samples.size(), 2 * samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    EXPECT_EQ(back.samples[2 * i] << 8 | back.samples[2 * i + 1], samples[i]);
}

TEST(Png, IsWholeOnlyToTheLastByte) {
  const std::vector<std::uint8_t> samples(300, 7);
  const std::string png = encode_png(10, 10, 3, samples, {{"Key", "text"}});
  EXPECT_TRUE(is_whole_png(png));
  EXPECT_FALSE(is_whole_png(png + "x"));
  for (std::size_t size = 0; size < png.size(); ++size)
    EXPECT_FALSE(is_whole_png(png.substr(0, size))) << size;
  for (std::size_t at = 0; at < png.size(); ++at) {
    std::string damaged = png;
    damaged[at] = char(damaged[at] ^ 4);
    EXPECT_FALSE(is_whole_png(damaged)) << at;
  }
}

}  // namespace
}  // namespace tind::proto
