#include "proto/image/webp.h"

#include <gtest/gtest.h>
#include <webp/decode.h>

#include <memory>
#include <vector>

namespace tind::proto {
namespace {

std::vector<std::uint8_t> any_samples(int count) {
  std::vector<std::uint8_t> samples;
  for (int i = 0; i < count; ++i) samples.push_back(std::uint8_t((i * i + 7 * i) % 251 * (i % 3)));
  return samples;
}

/// By libwebp's decoder; red, green, blue, alpha.
std::vector<std::uint8_t> decode(const std::string& webp, int width, int height) {
  int w = 0, h = 0;
  const std::unique_ptr<std::uint8_t, decltype(&WebPFree)> pixels(
      WebPDecodeRGBA(reinterpret_cast<const std::uint8_t*>(webp.data()), webp.size(), &w, &h),
      WebPFree);
  EXPECT_TRUE(pixels);
  EXPECT_EQ(w, width);
  EXPECT_EQ(h, height);
  if (!pixels || w != width || h != height) return {};
  return {pixels.get(), pixels.get() + std::size_t(4) * std::size_t(w) * std::size_t(h)};
}

TEST(Webp, KeepsEverySampleAlsoWhereAlphaIsNone) {
  for (const int channels : {1, 2, 3, 4})
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(5, 3), std::pair(70, 90)}) {
      const auto samples = any_samples(width * height * channels);
      const auto back =
          decode(encode_webp(width, height, channels, samples, "a text"), width, height);
      ASSERT_FALSE(back.empty());
      const bool grey = channels < 3;
      for (std::size_t k = 0; k < samples.size() / std::size_t(channels); ++k) {
        const std::uint8_t* const in = &samples[k * std::size_t(channels)];
        const std::uint8_t* const out = &back[4 * k];
        for (int c = 0; c < 3; ++c) ASSERT_EQ(out[c], in[grey ? 0 : c]) << channels << " " << k;
        ASSERT_EQ(out[3], channels % 2 == 0 ? in[channels - 1] : 255) << channels << " " << k;
      }
    }
}

TEST(Webp, SaysWhatItHas) {
  WebPBitstreamFeatures features;
  for (const int channels : {3, 4}) {
    const std::string webp = encode_webp(7, 9, channels, any_samples(7 * 9 * channels));
    ASSERT_EQ(
        WebPGetFeatures(reinterpret_cast<const std::uint8_t*>(webp.data()), webp.size(), &features),
        VP8_STATUS_OK);
    EXPECT_EQ(features.has_alpha, channels == 4);
    EXPECT_EQ(features.format, 2);  // without loss
    EXPECT_EQ(webp.find("XMP "), std::string::npos);
  }
  const std::string webp = encode_webp(1, 1, 1, any_samples(1), "a < b & c");
  EXPECT_NE(webp.find("x-default\">a &lt; b &amp; c</rdf:li>"), std::string::npos);
}

TEST(Webp, IsWholeOnlyToTheLastByte) {
  for (const char* text : {"", "odd", "even"}) {
    const std::string webp = encode_webp(10, 10, 3, any_samples(300), text);
    EXPECT_TRUE(is_whole_webp(webp));
    EXPECT_FALSE(is_whole_webp(webp + "x"));
    for (std::size_t size = 0; size < webp.size(); ++size)
      EXPECT_FALSE(is_whole_webp(webp.substr(0, size))) << size;
    for (std::size_t at = 0; at < webp.size(); ++at) {
      std::string damaged = webp;
      damaged[at] = char(damaged[at] ^ 4);
      EXPECT_FALSE(is_whole_webp(damaged)) << at;
    }
  }
}

}  // namespace
}  // namespace tind::proto
