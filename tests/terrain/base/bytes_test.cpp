#include "terrain/base/bytes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tind {
namespace {

TEST(Bytes, LieLittleEndFirstUnlessSaidOtherwise) {
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  out.put(std::uint32_t(0x01020304));
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{4, 3, 2, 1}));
  EXPECT_EQ((load<std::uint32_t, std::endian::big>(bytes.data())), 0x04030201u);
  store<std::endian::big>(std::uint16_t(0x0102), bytes.data());
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(bytes[1], 2);
}

TEST(Bytes, NumbersComeBackAsTheyWere) {
  std::string bytes;
  ByteWriter out(bytes);
  out.put(-0.0f), out.put(1e300), out.put(std::int64_t(-5)), out.put_text("end");
  ByteReader in(bytes);
  EXPECT_TRUE(std::signbit(in.get<float>()));
  EXPECT_EQ(in.get<double>(), 1e300);
  EXPECT_EQ(in.get<std::int64_t>(), -5);
  EXPECT_EQ(in.get_text(3), "end");
  EXPECT_TRUE(in.good());
  EXPECT_EQ(in.left(), 0u);
}

TEST(Bytes, VarintsTakeOneByteForSevenBits) {
  for (const std::int64_t v : {std::int64_t(0), std::int64_t(-1), std::int64_t(63),
                               std::int64_t(-64), std::int64_t(64), std::int64_t(1) << 33}) {
    std::vector<std::uint8_t> bytes;
    ByteWriter(bytes).put_signed_varint(v);
    EXPECT_EQ(bytes.size(), v == std::int64_t(1) << 33 ? 5u : v == 64 ? 2u : 1u) << v;
    ByteReader in(bytes);
    EXPECT_EQ(in.get_signed_varint(), v);
    EXPECT_TRUE(in.good());
  }
}

TEST(Bytes, AVarintWithoutEndIsRefused) {
  const std::vector<std::uint8_t> endless(20, 0xff);
  ByteReader in(endless);
  EXPECT_EQ(in.get_varint(6), 0u);
  EXPECT_TRUE(in.refused());
  EXPECT_FALSE(in.ended());
  EXPECT_EQ(in.at(), 6u);
}

TEST(Bytes, WhatIsNotThereReadsAsZeroAndIsSaid) {
  const std::vector<std::uint8_t> three = {1, 2, 3};
  ByteReader in(three);
  EXPECT_EQ(in.get<std::uint32_t>(), 0u);
  EXPECT_TRUE(in.ended());
  EXPECT_FALSE(in.good());
  EXPECT_EQ(in.left(), 3u);
  EXPECT_TRUE(ByteReader(three).get_bytes(4).empty());
  EXPECT_TRUE(ByteReader(three).get_text(std::numeric_limits<std::size_t>::max()).empty());
}

}  // namespace
}  // namespace tind
