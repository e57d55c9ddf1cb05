#include "server/http/message/escape.h"

#include <gtest/gtest.h>

namespace tind::http {
namespace {

TEST(Escaped, LeavesOneLineOfPrintableAscii) {
  EXPECT_EQ(escaped("/a?b=c d"), "/a?b=c d");
  EXPECT_EQ(escaped("a\r\nb\\\x1b\xc3\xa9"), "a\\x0d\\x0ab\\x5c\\x1b\\xc3\\xa9");
}

TEST(Escaped, HasNoKeyWhereverItWasPut) {
  const std::string key = "tind_" + std::string(43, 'k');
  for (const char* before : {"/x?Key=", "/x?api_key=", "/x?a;key=", "/x?key%3d", "/x/", ""})
    EXPECT_EQ(escaped(before + key + "&b=1"), std::string(before) + "tind_...&b=1");
  EXPECT_EQ(escaped(key + "/" + key), "tind_.../tind_...");
  EXPECT_EQ(escaped("tind_http_requests_total tind_"), "tind_http_requests_total tind_");
}

}  // namespace
}  // namespace tind::http
