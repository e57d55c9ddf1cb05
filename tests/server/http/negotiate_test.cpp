#include "server/http/message/negotiate.h"

#include <gtest/gtest.h>

#include "server/http/message/representation.h"

namespace tind::http {
namespace {

/// The fields of a request with these lines.
class Parsed {
 public:
  explicit Parsed(const std::string& lines)
      : bytes_("GET / HTTP/1.1\r\nHost: a\r\n" + lines + "\r\n"), parser_(limits_) {
    EXPECT_EQ(parser_.parse(bytes_), RequestParser::State::done);
  }
  const Fields& fields() const { return parser_.head().fields; }

 private:
  Limits limits_;
  std::string bytes_;
  RequestParser parser_;
};

bool gzip(const std::string& accept) {
  return wants_gzip(Parsed("Accept-Encoding: " + accept + "\r\n").fields());
}

TEST(WantsGzip, OnlyWhenAsked) {
  EXPECT_FALSE(wants_gzip(Parsed("").fields()));
  EXPECT_FALSE(gzip(""));
  EXPECT_FALSE(gzip("br"));
  EXPECT_FALSE(gzip("identity"));
  EXPECT_FALSE(gzip("gzipped"));
  EXPECT_TRUE(gzip("gzip"));
  EXPECT_TRUE(gzip("GZip"));
  EXPECT_TRUE(gzip("x-gzip"));
  EXPECT_TRUE(gzip("gzip, deflate, br, zstd"));
  EXPECT_TRUE(gzip("br;q=1.0,gzip;q=0.8 , *;q=0.1"));
  EXPECT_TRUE(gzip("*"));
  EXPECT_TRUE(
      wants_gzip(Parsed("Accept-Encoding: br\r\nHost2: x\r\naccept-encoding: gzip\r\n").fields()));
}

TEST(WantsGzip, HonoursWeights) {
  EXPECT_FALSE(gzip("gzip;q=0"));
  EXPECT_FALSE(gzip("gzip;q=0.0"));
  EXPECT_FALSE(gzip("gzip; Q=0.000"));
  EXPECT_FALSE(gzip("gzip;q=0, *"));
  EXPECT_FALSE(gzip("*;q=0"));
  EXPECT_TRUE(gzip("*;q=0, gzip"));
  EXPECT_TRUE(gzip("gzip;q=0.001"));
  EXPECT_TRUE(gzip("gzip;q=1.000"));
  EXPECT_FALSE(gzip("gzip;q=0.5, identity"));
  EXPECT_TRUE(gzip("gzip, identity;q=0.5"));
  EXPECT_TRUE(gzip("gzip;q=0.5, identity;q=0"));
  EXPECT_FALSE(gzip("gzip;q=x"));
  EXPECT_FALSE(gzip("gzip;q=2"));
  EXPECT_FALSE(gzip("gzip;q="));
}

TEST(ListsEtag, ComparesWeakly) {
  const std::string tag = "\"abc\"";
  for (const char* yes : {"*", "\"abc\"", "W/\"abc\"", "\"x\", \"abc\"", "\"x\",\"abc\",\"y\"",
                          " \"abc\" ", "\"a,b\", \"abc\"", "W/\"x\", W/\"abc\""})
    EXPECT_TRUE(lists_etag(yes, tag)) << yes;
  for (const char* no : {"", "abc", "\"abc", "\"ab\"", "\"abcd\"", "\"x\" \"abc\"", "w/\"abc\"",
                         "\"x, \"abc\"", "**", "\"*\"", ","})
    EXPECT_FALSE(lists_etag(no, tag)) << no;
}

TEST(Representation, EncodingsHaveTheirOwnTags) {
  const std::string body(5000, 'x');
  const auto made = Representation::make(body, {.content_type = "text/plain"});
  EXPECT_EQ(made->body(), body);
  const auto send = [&](const std::string& lines) { return made->reply(Parsed(lines).fields()); };
  const Reply plain = send(""), packed = send("Accept-Encoding: gzip\r\n");
  EXPECT_EQ(plain.status, 200);
  EXPECT_EQ(plain.payload->body(), body);
  EXPECT_LT(packed.payload->body().size(), 200u);
  EXPECT_NE(packed.payload->bytes.find("Content-Encoding: gzip\r\n"), std::string::npos);
  const std::string tag(made->etag()), gzip_tag = tag.substr(0, tag.size() - 1) + "-gz\"";
  EXPECT_EQ(send("If-None-Match: " + tag + "\r\n").status, 304);
  EXPECT_EQ(send("If-None-Match: " + gzip_tag + "\r\n").status, 200);
  EXPECT_EQ(send("Accept-Encoding: gzip\r\nIf-None-Match: " + gzip_tag + "\r\n").status, 304);
  EXPECT_EQ(send("Accept-Encoding: gzip\r\nIf-None-Match: " + tag + "\r\n").status, 200);
  EXPECT_EQ(send("If-None-Match: \"x\"\r\nIf-None-Match: " + tag + "\r\n").status, 304);
}

TEST(Representation, OfAnotherStateThanIfMatchNamesIsNotGiven) {
  const std::string body(5000, 'x');
  const auto made =
      Representation::make(body, {.content_type = "a/b", .compress = false, .ranges = true});
  const auto send = [&](const std::string& lines) {
    return made->reply(Parsed(lines).fields()).status;
  };
  const std::string tag(made->etag()), part = "Range: bytes=1-2\r\n";
  EXPECT_EQ(send("If-Match: " + tag + "\r\n" + part), 206);
  EXPECT_EQ(send("If-Match: \"x\", " + tag + "\r\n"), 200);
  EXPECT_EQ(send("If-Match: *\r\n"), 200);
  EXPECT_EQ(send("If-Match: \"x\"\r\n" + part), 412);
  EXPECT_EQ(send("If-Match: W/" + tag + "\r\n"), 412) << "weak tags match nothing";
  EXPECT_EQ(send("If-Match: \"x\"\r\nIf-None-Match: " + tag + "\r\n"), 412);
}

TEST(Representation, WhatDoesNotShrinkIsNotCompressed) {
  const auto small = Representation::make("hello", {.content_type = "text/plain"});
  const Reply reply = small->reply(Parsed("Accept-Encoding: gzip\r\n").fields());
  EXPECT_EQ(reply.payload->body(), "hello");
  EXPECT_EQ(reply.payload->bytes.find("Content-Encoding"), std::string::npos);
}

TEST(Representation, SameBytesSameTag) {
  const auto tag = [](const std::string& body) {
    return std::string(Representation::make(body, {.content_type = "a/b"})->etag());
  };
  EXPECT_EQ(tag("one"), tag("one"));
  EXPECT_NE(tag("one"), tag("two"));
  EXPECT_EQ(tag("").size(), 34u);
}

}  // namespace
}  // namespace tind::http
