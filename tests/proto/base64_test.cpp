#include "proto/base64.h"

#include <gtest/gtest.h>

namespace tind::proto {
namespace {

TEST(Base64, IsThatOfRfc4648) {
  const std::pair<std::string, std::string> known[] = {{"", ""},
                                                       {"f", "Zg=="},
                                                       {"fo", "Zm8="},
                                                       {"foo", "Zm9v"},
                                                       {"foob", "Zm9vYg=="},
                                                       {"fooba", "Zm9vYmE="},
                                                       {"foobar", "Zm9vYmFy"},
                                                       {std::string("\0\xff\xfe", 3), "AP/+"}};
  for (const auto& [bytes, text] : known) {
    std::string encoded;
    put_base64(encoded, bytes);
    EXPECT_EQ(encoded, text);
    EXPECT_EQ(decode_base64(text), bytes);
  }
}

TEST(Base64, AnythingElseIsNone) {
  for (const char* const text : {"Z", "Zg", "Zg=", "Zg==\n", "Zm9 ", "Zm-_", "=Zg=", "====",
                                 "Zg===", "Zh==" /* bits that mean nothing */, "Zm9="})
    EXPECT_FALSE(decode_base64(text)) << text;
}

TEST(Base64, EveryByteComesBack) {
  std::string bytes;
  for (int i = 0; i < 1000; ++i) bytes += char(i * 37 + i / 256);
  for (std::size_t size = 0; size < bytes.size(); size += 7) {
    std::string text;
    put_base64(text, std::string_view(bytes).substr(0, size));
    EXPECT_EQ(decode_base64(text), bytes.substr(0, size));
  }
}

}  // namespace
}  // namespace tind::proto
