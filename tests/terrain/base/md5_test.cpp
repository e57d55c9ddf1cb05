// MD5 by the test suite of RFC 1321, A.5.

#include "terrain/base/md5.h"

#include <gtest/gtest.h>

#include <string>

namespace tind {
namespace {

std::string digits(const std::string& text) {
  std::string out;
  for (const std::uint8_t b : md5(text))
    out += "0123456789abcdef"[b >> 4], out += "0123456789abcdef"[b & 15];
  return out;
}

TEST(Md5, TheTestsOfTheStandard) {
  EXPECT_EQ(digits(""), "d41d8cd98f00b204e9800998ecf8427e");
  EXPECT_EQ(digits("a"), "0cc175b9c0f1b6a831c399e269772661");
  EXPECT_EQ(digits("abc"), "900150983cd24fb0d6963f7d28e17f72");
  EXPECT_EQ(digits("message digest"), "f96b697d7cb7938d525a2f31aaf161d0");
  EXPECT_EQ(digits("abcdefghijklmnopqrstuvwxyz"), "c3fcd3d76192e4007dfb496cca67e13b");
  EXPECT_EQ(digits("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"),
            "d174ab98d277d9f5a5611c2c9f419d9f");
  EXPECT_EQ(digits("1234567890123456789012345678901234567890123456789012345678901234567890123456789"
                   "0"),
            "57edf4a22be3c955ac49da2e2107b67a");
}

}  // namespace
}  // namespace tind
