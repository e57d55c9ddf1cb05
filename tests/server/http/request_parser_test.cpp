#include "server/http/message/request_parser.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/http_probes.h"

namespace tind::http {
namespace {

using State = RequestParser::State;

/// "done METHOD path query host minor keep" or "refused STATUS" or "more".
std::string verdict(const RequestParser& parser, State state) {
  if (state == State::more) return "more";
  if (state == State::refused) return "refused " + std::to_string(parser.refusal().status);
  const RequestHead& head = parser.head();
  std::string text = "done " + std::string(name(head.method)) + " " + std::string(head.path) + " " +
                     std::string(head.query) + " " + std::string(head.host) + " 1." +
                     std::to_string(head.minor) + (head.keep_alive ? " keep" : " close");
  text += " fields=" + std::to_string(head.fields.size());
  text += " consumed=" + std::to_string(parser.consumed());
  return text;
}

std::string parse_whole(const std::string& bytes, const Limits& limits = {}) {
  RequestParser parser(limits);
  return verdict(parser, parser.parse(bytes));
}

/// In pieces, each time from a buffer that lies elsewhere.
std::string parse_split(const std::string& bytes, std::size_t first, std::size_t step) {
  const Limits limits;
  RequestParser parser(limits);
  State state = State::more;
  std::string buffer;
  for (std::size_t size = first; state == State::more; size += step) {
    buffer = std::string(bytes, 0, size);
    state = parser.parse(buffer);
    if (size >= bytes.size()) break;
  }
  return verdict(parser, state);
}

TEST(RequestParser, ReadsAnOrdinaryRequest) {
  const Limits limits;
  RequestParser parser(limits);
  const std::string bytes =
      "GET /terrain/a/1/2/3.terrain?v=1 HTTP/1.1\r\nHost: h:80\r\nAccept:  a/b , c/d \t\r\n"
      "X-Empty:\r\naccept: e\r\n\r\nGET";
  ASSERT_EQ(parser.parse(bytes), State::done);
  const RequestHead& head = parser.head();
  EXPECT_EQ(head.method, Method::get);
  EXPECT_EQ(head.target, "/terrain/a/1/2/3.terrain?v=1");
  EXPECT_EQ(head.path, "/terrain/a/1/2/3.terrain");
  EXPECT_EQ(head.query, "v=1");
  EXPECT_EQ(head.host, "h:80");
  EXPECT_TRUE(head.keep_alive);
  EXPECT_EQ(head.fields.find("accept"), "a/b , c/d");
  EXPECT_EQ(head.fields.find("x-empty"), "");
  EXPECT_FALSE(head.fields.find("x-none"));
  std::string all;
  head.fields.each("accept",
                   [&](std::string_view value) { all += "[" + std::string(value) + "]"; });
  EXPECT_EQ(all, "[a/b , c/d][e]");
  EXPECT_EQ(bytes.substr(parser.consumed()), "GET");
}

TEST(RequestParser, AbsoluteFormNamesTheHost) {
  EXPECT_EQ(parse_whole("GET http://a.b:1/p?q HTTP/1.1\r\nHost: other\r\n\r\n"),
            "done GET /p q a.b:1 1.1 keep fields=1 consumed=46");
  EXPECT_EQ(parse_whole("GET http://a?q HTTP/1.1\r\nHost: a\r\n\r\n"),
            "done GET / q a 1.1 keep fields=1 consumed=36");
}

TEST(RequestParser, ConnectionDecidesWhetherItIsKept) {
  const auto keeps = [](const std::string& version, const std::string& fields) {
    return parse_whole("GET / HTTP/" + version + "\r\nHost: a\r\n" + fields + "\r\n")
               .find(" keep ") != std::string::npos;
  };
  EXPECT_TRUE(keeps("1.1", ""));
  EXPECT_FALSE(keeps("1.1", "Connection: close\r\n"));
  EXPECT_FALSE(keeps("1.1", "connection: x , CLOSE\r\n"));
  EXPECT_FALSE(keeps("1.1", "Connection: x,close\r\n"));
  EXPECT_FALSE(keeps("1.1", "Connection: close \t,x\r\n"));
  EXPECT_FALSE(keeps("1.1", "Connection: \t close\r\n"));
  EXPECT_FALSE(keeps("1.1", "Connection: keep-alive\r\nConnection: close\r\n"));
  EXPECT_FALSE(keeps("1.0", ""));
  EXPECT_TRUE(keeps("1.0", "Connection: Keep-Alive\r\n"));
  EXPECT_FALSE(keeps("1.0", "Connection: keep-alive, close\r\n"));
}

TEST(RequestParser, EveryProbeGetsItsVerdict) {
  for (const test::Probe& probe : test::probes()) {
    const std::string got = parse_whole(probe.bytes);
    if (probe.status >= 400) {
      EXPECT_EQ(got, "refused " + std::to_string(probe.status)) << probe.name;
    } else {
      EXPECT_EQ(got.substr(0, 4), "done") << probe.name;
    }
  }
}

TEST(RequestParser, TheVerdictDoesNotDependOnHowBytesArrive) {
  std::size_t deliveries = 0;
  for (const test::Probe& probe : test::probes()) {
    const std::string whole = parse_whole(probe.bytes);
    EXPECT_EQ(parse_split(probe.bytes, 1, 1), whole) << probe.name << ", byte by byte";
    // Every split point; of the few that are thousands of bytes long, the ends and a sample.
    const std::size_t size = probe.bytes.size(), stride = size > 1000 ? 97 : 1;
    for (std::size_t split = 1; split < size; split += stride, ++deliveries)
      ASSERT_EQ(parse_split(probe.bytes, split, size), whole) << probe.name << " at " << split;
  }
  EXPECT_GT(deliveries, 5000u);
}

TEST(RequestParser, CountsFieldsAndBytes) {
  const auto with_fields = [](int count) {
    std::string bytes = "GET / HTTP/1.1\r\nHost: a\r\n";
    for (int i = 1; i < count; ++i) bytes += "x: y\r\n";
    return parse_whole(bytes + "\r\n").substr(0, 11);
  };
  EXPECT_EQ(with_fields(100), "done GET / ");
  EXPECT_EQ(with_fields(101), "refused 431");
  const auto of_size = [](std::size_t size) {
    std::string bytes = "GET / HTTP/1.1\r\nHost: a\r\nx: ";
    bytes += std::string(size - bytes.size() - 4, 'y') + "\r\n\r\n";
    return parse_whole(bytes).substr(0, 11);
  };
  EXPECT_EQ(of_size(8192), "done GET / ");
  EXPECT_EQ(of_size(8193), "refused 431");
}

TEST(RequestParser, SaysHowLongTheBodyIs) {
  const Limits limits;
  const auto length = [&](const std::string& request) {
    RequestParser parser(limits);
    const std::string bytes = request + "Host: a\r\n\r\n";
    return parser.parse(bytes) == State::done
               ? std::to_string(parser.head().content_length.value_or(0))
               : verdict(parser, State::refused);
  };
  EXPECT_EQ(length("POST / HTTP/1.1\r\n"), "0");
  EXPECT_EQ(length("POST / HTTP/1.1\r\nContent-Length: 1207\r\n"), "1207");
  EXPECT_EQ(length("POST / HTTP/1.1\r\nContent-Length: 999999999999999999\r\n"),
            "999999999999999999");
  EXPECT_EQ(length("POST / HTTP/1.1\r\nContent-Length: 1000000000000000000\r\n"), "refused 400");
  EXPECT_EQ(length("GET / HTTP/1.1\r\nContent-Length: 0\r\n"), "0");
  EXPECT_EQ(length("GET / HTTP/1.1\r\nContent-Length: 1\r\n"), "refused 400");
}

TEST(RequestParser, ResetForgetsEverything) {
  const Limits limits;
  RequestParser parser(limits);
  EXPECT_EQ(parser.parse("GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"), State::done);
  parser.reset();
  EXPECT_EQ(verdict(parser, parser.parse("HEAD /b HTTP/1.1\r\nHost: c\r\n\r\n")),
            "done HEAD /b  c 1.1 keep fields=1 consumed=29");
}

TEST(ValidAuthority, TellsHostsFromOtherThings) {
  for (const char* good :
       {"a", "example.org", "example.org:80", "127.0.0.1:8080", "[::1]", "[::1]:80", "a%20b",
        "a%aF", "a%fA", "a%aFz", "xn--e1afmkfd", "h:", "h:65535", "a_b"})
    EXPECT_TRUE(valid_authority(good)) << good;
  for (const char* bad : {"",        ":80",      "a/b",  "a@b",  "u:p@h", "a b",    "h:x",
                          "h:65536", "h:123456", "[",    "[]",   "[::1",  "[::1]x", "[g::]",
                          "a%2",     "a%zz",     "a%2z", "a%z2", "a\"b",  "a\\b",   "::1"})
    EXPECT_FALSE(valid_authority(bad)) << bad;
  EXPECT_FALSE(valid_authority(std::string_view("a%2f").substr(0, 3)));
  EXPECT_TRUE(valid_authority(std::string(255, 'a')));
  EXPECT_FALSE(valid_authority(std::string(256, 'a')));
}

}  // namespace
}  // namespace tind::http
