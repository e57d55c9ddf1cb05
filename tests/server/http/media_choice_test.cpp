#include "server/http/message/media_choice.h"

#include <gtest/gtest.h>

#include <string>

#include "server/http/message/request_parser.h"

namespace tind::http {
namespace {

/// Of a JSON document, a page and an image; -1: none of them.
int chosen(const std::string& fields) {
  constexpr std::string_view kTypes[] = {"application/json", "text/html", "image/tiff"};
  const std::string head = "GET / HTTP/1.1\r\nHost: h\r\n" + fields + "\r\n";
  const Limits limits;
  RequestParser parser(limits);
  EXPECT_EQ(parser.parse(head), RequestParser::State::done) << fields;
  const auto choice = preferred_type(parser.head().fields, kTypes);
  return choice ? int(*choice) : -1;
}

TEST(MediaChoice, takes_what_the_client_would_rather_have) {
  EXPECT_EQ(chosen(""), 0);
  EXPECT_EQ(chosen("Accept: */*\r\n"), 0);
  EXPECT_EQ(chosen("Accept: text/html,application/xhtml+xml,*/*;q=0.8\r\n"), 1);
  EXPECT_EQ(chosen("Accept: text/html;q=0.5, application/json\r\n"), 0);
  EXPECT_EQ(chosen("Accept: TEXT/*\r\n"), 1);
  EXPECT_EQ(chosen("Accept: image/tiff;application=geotiff\r\n"), 2);
  EXPECT_EQ(chosen("Accept: image/png\r\nAccept: image/*;q=0.1\r\n"), 2)
      << "two fields are one list";
}

TEST(MediaChoice, a_closer_range_decides) {
  EXPECT_EQ(chosen("Accept: */*, application/json;q=0\r\n"), 1);
  EXPECT_EQ(chosen("Accept: text/*;q=0.9, text/html;q=0.1, application/*;q=0.5\r\n"), 0);
}

TEST(MediaChoice, none_where_none_is_wanted) {
  EXPECT_EQ(chosen("Accept: video/mp4\r\n"), -1);
  EXPECT_EQ(chosen("Accept: */*;q=0\r\n"), -1);
  EXPECT_EQ(chosen("Accept: text/html;q=nonsense\r\n"), -1);
}

}  // namespace
}  // namespace tind::http
