#include "terrain/base/hash.h"

#include <gtest/gtest.h>

namespace tind {
namespace {

// The values of an empty input, as xxHash documents them.
TEST(Hash, are_the_published_ones) {
  EXPECT_EQ(hash64(std::string_view()), 0x2d06800538d394c2u);
  EXPECT_EQ(hash128(std::string_view()).text(), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, depend_on_every_byte_and_the_seed) {
  EXPECT_NE(hash64(std::string_view("a")), hash64(std::string_view("b")));
  EXPECT_NE(hash64(std::string_view("a")), hash64(std::string_view("a"), 1));
  EXPECT_EQ(hash64(std::string_view("a")), hash64(std::string_view("a"), 0));
  EXPECT_NE(hash128(std::string_view("a")), hash128(std::string_view("b")));
}

TEST(Hash, the_text_has_the_high_half_first_and_all_zeros) {
  EXPECT_EQ((Hash128{.low = 0xab, .high = 0x1}.text()), "000000000000000100000000000000ab");
}

}  // namespace
}  // namespace tind
