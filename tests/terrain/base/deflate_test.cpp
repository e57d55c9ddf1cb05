#include "terrain/base/deflate.h"

#include <gtest/gtest.h>

namespace tind {
namespace {

std::string text() {
  std::string text;
  for (int i = 0; i < 500; ++i) text += "post " + std::to_string(i * i % 97) + '\n';
  return text;
}
std::string as_text(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

TEST(Deflate, comes_back_from_every_wrapping) {
  for (const Wrapping wrapping : {Wrapping::none, Wrapping::zlib, Wrapping::gzip}) {
    const auto packed = deflate(text(), wrapping, 6);
    EXPECT_LT(packed.size(), text().size() / 2);
    const auto back = inflate(packed, wrapping, text().size());
    ASSERT_TRUE(back);
    EXPECT_EQ(as_text(*back), text());
    EXPECT_EQ(inflate(packed, wrapping, text().size() + 100)->size(), text().size());
    EXPECT_FALSE(inflate(packed, wrapping, text().size() - 1));
  }
}

TEST(Deflate, nothing_rather_than_more_than_was_asked_for) {
  const auto packed = deflate<std::string>(text(), Wrapping::gzip, 6);
  EXPECT_EQ(deflate<std::string>(text(), Wrapping::gzip, 6, packed.size() + 100), packed);
  EXPECT_TRUE(deflate<std::string>(text(), Wrapping::gzip, 6, packed.size() / 2).empty());
}

TEST(Deflate, is_what_others_read) {
  // Made by Python's gzip.compress(b"tind" * 20, mtime=0).
  const std::vector<std::uint8_t> theirs = {0x1f, 0x8b, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02,
                                            0x03, 0x2b, 0xc9, 0xcc, 0x4b, 0x29, 0xa1, 0x22, 0x06,
                                            0x00, 0x77, 0xf7, 0x9c, 0x5b, 0x50, 0x00, 0x00, 0x00};
  EXPECT_TRUE(is_gzip(theirs));
  std::string expected;
  for (int i = 0; i < 20; ++i) expected += "tind";
  const auto back = gunzip(theirs, 80);
  ASSERT_TRUE(back);
  EXPECT_EQ(as_text(*back), expected);
  EXPECT_EQ(crc32(std::string_view("123456789")), 0xcbf43926u);
}

TEST(Deflate, gunzip_takes_one_whole_file_within_the_bound) {
  const auto packed = deflate(text(), Wrapping::gzip, 6);
  EXPECT_TRUE(gunzip(packed, text().size()));
  const auto above = gunzip(packed, text().size() - 1);
  ASSERT_FALSE(above);
  EXPECT_EQ(above.error().code, Errc::bad_data);
  EXPECT_EQ(above.error().what, "damaged gzip data");
  for (std::size_t size = 0; size < packed.size(); ++size)
    EXPECT_FALSE(gunzip({packed.data(), size}, 1 << 20)) << size;
  for (std::size_t i = packed.size() - 8; i < packed.size(); ++i) {  // checksum and size
    auto other = packed;
    other[i] ^= 1;
    EXPECT_FALSE(gunzip(other, 1 << 20)) << i;
  }
}

TEST(Deflate, gzip_is_told_by_its_first_two_bytes) {
  EXPECT_FALSE(is_gzip(std::string_view("\x1f", 1)));
  EXPECT_FALSE(is_gzip(std::string_view("")));
  EXPECT_FALSE(is_gzip(std::string_view("PK\3\4")));
}

}  // namespace
}  // namespace tind
