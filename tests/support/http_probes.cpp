#include "tests/support/http_probes.h"

namespace tind::test {
namespace {

using std::string;

/// A complete request but for what is under test.
string get(const string& fields) { return "GET / HTTP/1.1\r\nHost: test\r\n" + fields + "\r\n"; }
string post(const string& fields, const string& body = "") {
  return "POST / HTTP/1.1\r\nHost: test\r\n" + fields + "\r\n" + body;
}
string target(const string& text) { return "GET " + text + " HTTP/1.1\r\nHost: test\r\n\r\n"; }
string line(const string& text) { return text + "\r\nHost: test\r\n\r\n"; }
string host(const string& text) { return "GET / HTTP/1.1\r\n" + text + "\r\n"; }
string with_nul(const string& text) {
  string bytes = text;
  for (char& c : bytes)
    if (c == '@') c = '\0';
  return bytes;
}

std::vector<Probe> request_lines() {
  return {
      {"lower-case method", line("get / HTTP/1.1"), 501},
      {"unknown method", line("BREW / HTTP/1.1"), 501},
      {"TRACE", line("TRACE / HTTP/1.1"), 501},
      {"CONNECT", line("CONNECT test:80 HTTP/1.1"), 501},
      {"method with a separator", line("GE(T / HTTP/1.1"), 400},
      {"empty method", line(" / HTTP/1.1"), 400},
      {"two spaces before the target", line("GET  / HTTP/1.1"), 400},
      {"two spaces before the version", line("GET /  HTTP/1.1"), 400},
      {"trailing space", line("GET / HTTP/1.1 "), 400},
      {"leading space", line(" GET / HTTP/1.1"), 400},
      {"tab for a space", line("GET\t/\tHTTP/1.1"), 400},
      {"no version (HTTP/0.9)", "GET /\r\n\r\n", 400},
      {"only a method", "GET\r\n\r\n", 400},
      {"HTTP/0.9", line("GET / HTTP/0.9"), 505},
      {"HTTP/1.2", line("GET / HTTP/1.2"), 505},
      {"HTTP/2.0", line("GET / HTTP/2.0"), 505},
      {"the HTTP/2 preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505},
      {"HTTP/1.10", line("GET / HTTP/1.10"), 400},
      {"HTTP/1", line("GET / HTTP/1"), 400},
      {"HTTP/1,1", line("GET / HTTP/1,1"), 400},
      {"http/1.1", line("GET / http/1.1"), 400},
      {"HTTP/ 1.1", line("GET / HTTP/ 1.1"), 400},
      {"HTTPS/1.1", line("GET / HTTPS/1.1"), 400},
      {"version of letters", line("GET / HTTP/a.b"), 400},
      {"two empty lines first", "\r\n\r\nGET / HTTP/1.1\r\nHost: test\r\n\r\n", 400},
      {"a bare LF first", "\nGET / HTTP/1.1\r\nHost: test\r\n\r\n", 400},
      {"NUL in the method", with_nul("G@T / HTTP/1.1\r\nHost: test\r\n\r\n"), 400},
      {"a TLS hello", string("\x16\x03\x01\x02\x00\x01\x00\x01", 8), 400},
      {"binary noise", "\xff\xfe\xfd\xfc\r\n\r\n", 400},
      {"an endless method", string(9000, 'A'), 414},
      {"a response", "HTTP/1.1 200 OK\r\nHost: test\r\n\r\n", 400},
  };
}

std::vector<Probe> targets() {
  return {
      {"fragment", target("/a#b"), 400},
      {"only a fragment", target("#"), 400},
      {"no leading slash", target("a/b"), 400},
      {"backslash first", target("\\a"), 400},
      {"asterisk with GET", target("*"), 400},
      {"asterisk and more", "OPTIONS *a HTTP/1.1\r\nHost: test\r\n\r\n", 400},
      {"space in the target", target("/a b"), 400},
      {"NUL in the target", with_nul(target("/a@b")), 400},
      {"DEL in the target", target("/a\x7f"), 400},
      {"control byte in the target", target("/a\x01"), 400},
      {"raw UTF-8 in the target", target("/\xc3\xa9"), 400},
      {"a bare CR in the target", target("/a\rb"), 400},
      {"ftp scheme", target("ftp://test/a"), 400},
      {"absolute form without host", target("http:///a"), 400},
      {"absolute form with user", target("http://user@test/a"), 400},
      {"absolute form with user and password", target("http://u:p@test/a"), 400},
      {"absolute form with a bad port", target("http://test:99999/"), 400},
      {"absolute form with a bad host", target("http://a\"b/"), 400},
      {"authority form with GET", target("test:80"), 400},
      {"javascript scheme", target("javascript:alert(1)"), 400},
      {"a target of 8 KiB", target("/" + string(8200, 'a')), 414},
  };
}

std::vector<Probe> fields() {
  return {
      {"space before the colon", get("X-A : b\r\n"), 400},
      {"tab before the colon", get("X-A\t: b\r\n"), 400},
      {"space in the name", get("X A: b\r\n"), 400},
      {"no colon", get("X-A\r\n"), 400},
      {"empty name", get(": b\r\n"), 400},
      {"NUL in the name", with_nul(get("X@A: b\r\n")), 400},
      {"NUL in the value", with_nul(get("X-A: b@c\r\n")), 400},
      {"control byte in the value", get("X-A: b\x01\r\n"), 400},
      {"DEL in the value", get("X-A: b\x7f\r\n"), 400},
      {"vertical tab in the value", get("X-A: b\x0b\r\n"), 400},
      {"non-ASCII name", get("X-\xc3\xa9: b\r\n"), 400},
      {"separator in the name", get("X(A): b\r\n"), 400},
      {"slash in the name", get("X/A: b\r\n"), 400},
      {"quote in the name", get("\"X\": b\r\n"), 400},
      {"obs-fold with a space", get("X-A: b\r\n c\r\n"), 400},
      {"obs-fold with a tab", get("X-A: b\r\n\tc\r\n"), 400},
      {"folded before the first field", "GET / HTTP/1.1\r\n X: y\r\nHost: test\r\n\r\n", 400},
      {"a line of one space", get(" \r\n"), 400},
      {"bare LF after a field", "GET / HTTP/1.1\r\nHost: test\nX: y\r\n\r\n", 400},
      {"bare LF after the request line", "GET / HTTP/1.1\nHost: test\r\n\r\n", 400},
      {"bare LFs everywhere", "GET / HTTP/1.1\nHost: test\n\n", 400},
      {"bare LF at the end", "GET / HTTP/1.1\r\nHost: test\r\n\n", 400},
      {"bare CR in a value", get("X-A: b\rc\r\n"), 400},
      {"bare CR before CR LF", get("X-A: b\r\r\n"), 400},
      {"bare CRs for line ends", "GET / HTTP/1.1\rHost: test\r\r", 400},
      {"LF CR for a line end", "GET / HTTP/1.1\n\rHost: test\n\r\n\r", 400},
      {"101 fields", get([] {
         string many;
         for (int i = 0; i < 100; ++i) many += "x: y\r\n";
         return many;
       }()),
       431},
      {"fields of 8 KiB", get("X-A: " + string(8200, 'b') + "\r\n"), 431},
      {"a name of 8 KiB", get(string(8200, 'b') + ": c\r\n"), 431},
      {"an endless field", "GET / HTTP/1.1\r\nHost: test\r\nX: " + string(9000, 'y'), 431},
      {"unknown expectation", get("Expect: 200-ok\r\n"), 417},
      {"one expectation of two unknown", get("Expect: 100-continue\r\nExpect: x\r\n"), 417},
  };
}

std::vector<Probe> hosts() {
  return {
      {"no Host", "GET / HTTP/1.1\r\n\r\n", 400},
      {"no Host but other fields", host("X: y\r\n"), 400},
      {"empty Host", host("Host:\r\n"), 400},
      {"Host of spaces", host("Host:   \r\n"), 400},
      {"two Hosts", host("Host: a\r\nHost: b\r\n"), 400},
      {"two equal Hosts", host("Host: a\r\nHost: a\r\n"), 400},
      {"two Hosts in HTTP/1.0", "GET / HTTP/1.0\r\nHost: a\r\nHost: b\r\n\r\n", 400},
      {"Host with a path", host("Host: a/b\r\n"), 400},
      {"Host with a user", host("Host: u@a\r\n"), 400},
      {"Host with path and user", host("Host: a/b@c\r\n"), 400},
      {"Host with a space", host("Host: a b\r\n"), 400},
      {"Host list", host("Host: a, b\r\n"), 400},
      {"Host with a bad port", host("Host: a:b\r\n"), 400},
      {"Host with port 65536", host("Host: a:65536\r\n"), 400},
      {"Host with two ports", host("Host: a:1:2\r\n"), 400},
      {"Host with a scheme", host("Host: http://a\r\n"), 400},
      {"Host with a query", host("Host: a?b\r\n"), 400},
      {"Host with a fragment", host("Host: a#b\r\n"), 400},
      {"Host with a backslash", host("Host: a\\b\r\n"), 400},
      {"Host with raw UTF-8", host("Host: \xc3\xa9\r\n"), 400},
      {"Host with an open bracket", host("Host: [::1\r\n"), 400},
      {"Host with a bad escape", host("Host: a%zz\r\n"), 400},
      {"absolute form and no Host", "GET http://test/ HTTP/1.1\r\n\r\n", 400},
      {"absolute form and two Hosts", "GET http://t/ HTTP/1.1\r\nHost: t\r\nHost: t\r\n\r\n", 400},
  };
}

/// Where a message ends: what two programs in a row can be made to disagree about.
std::vector<Probe> framing() {
  const string length = "Content-Length: 5\r\n", smuggled = "GET /x HTTP/1.1\r\nHost: a\r\n\r\n";
  const auto coding = [](const string& value) {
    return post("Transfer-Encoding: " + value + "\r\n", "0\r\n\r\n");
  };
  const auto sized = [](const string& value) {
    return post("Content-Length: " + value + "\r\n", "hello");
  };
  return {
      {"chunked", coding("chunked"), 501},
      {"chunked GET", get("Transfer-Encoding: chunked\r\n") + "0\r\n\r\n", 501},
      {"chunked with a trailer of 64 KiB",
       post("Transfer-Encoding: chunked\r\n", "0\r\nX: " + string(65600, 'a') + "\r\n\r\n"), 501},
      {"xchunked", coding("xchunked"), 501},
      {"identity coding", coding("identity"), 501},
      {"gzip coding", coding("gzip"), 501},
      {"chunked, gzip", coding("chunked, gzip"), 501},
      {"gzip, chunked", coding("gzip, chunked"), 501},
      {"quoted chunked", coding("\"chunked\""), 501},
      {"chunked with a parameter", coding("chunked;a=b"), 501},
      {"a comma before chunked", coding(",chunked"), 501},
      {"empty coding", coding(""), 501},
      {"vertical tab before chunked",
       coding("\x0b"
              "chunked"),
       400},
      {"folded coding", post("Transfer-Encoding:\r\n chunked\r\n", "0\r\n\r\n"), 400},
      {"space before the coding's colon", post("Transfer-Encoding : chunked\r\n", "0\r\n\r\n"),
       400},
      {"two codings",
       post("Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n", "0\r\n\r\n"), 400},
      {"length then coding",
       post(length + "Transfer-Encoding: chunked\r\n", "0\r\n\r\n" + smuggled), 400},
      {"coding then length",
       post("Transfer-Encoding: chunked\r\n" + length, "0\r\n\r\n" + smuggled), 400},
      {"gzip coding and length", post("Transfer-Encoding: gzip\r\n" + length, "hello"), 400},
      {"coding in odd case and length", post("tRANSFER-eNCODING: chunked\r\n" + length, "hello"),
       400},
      {"coding in HTTP/1.0",
       "POST / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400},
      {"two different lengths", post(length + "Content-Length: 6\r\n", "hello!"), 400},
      {"two equal lengths", post(length + length, "hello"), 400},
      {"a list of equal lengths", sized("5, 5"), 400},
      {"a list of lengths", sized("5,6"), 400},
      {"+5", sized("+5"), 400},
      {"-5", sized("-5"), 400},
      {"-0", sized("-0"), 400},
      {"0x5", sized("0x5"), 400},
      {"5.0", sized("5.0"), 400},
      {"5e0", sized("5e0"), 400},
      {"5 bytes", sized("5 bytes"), 400},
      {"empty length", sized(""), 400},
      {"a length of letters", sized("abc"), 400},
      {"quoted length", sized("\"5\""), 400},
      {"5;q=1", sized("5;q=1"), 400},
      {"a length beyond 64 bits", sized("18446744073709551617"), 400},
      {"a length of 100 digits", sized(string(100, '9')), 400},
      {"length in Arabic digits", sized("\xd9\xa5"), 400},
      {"GET with a body", get(length) + "hello", 400},
      {"HEAD with a body", "HEAD / HTTP/1.1\r\nHost: a\r\n" + length + "\r\nhello", 400},
      {"OPTIONS with a body", "OPTIONS / HTTP/1.1\r\nHost: a\r\n" + length + "\r\nhello", 400},
      {"DELETE with a body", "DELETE / HTTP/1.1\r\nHost: a\r\n" + length + "\r\nhello", 400},
      {"GET with a request as its body", get("Content-Length: 33\r\n") + smuggled, 400},
  };
}

std::vector<Probe> unusual_but_right() {
  return {
      {"an ordinary GET", get(""), 200},
      {"one empty line first", "\r\n" + get(""), 200},
      {"HTTP/1.0 without Host", "GET / HTTP/1.0\r\n\r\n", 200},
      {"absolute form", target("http://test/"), 200},
      {"absolute form in odd case", target("HTTP://test/"), 200},
      {"absolute form with https", target("https://test:8080/"), 200},
      {"Host with a port", host("Host: test:8080\r\n"), 200},
      {"Host in brackets", host("Host: [::1]:80\r\n"), 200},
      {"Host in odd case", host("hOST: test\r\n"), 200},
      {"no space after the colon", host("Host:test\r\n"), 200},
      {"many spaces after the colon", host("Host:   \t test \t \r\n"), 200},
      {"an empty value", get("X-A:\r\n"), 200},
      {"a colon in the value", get("X-A: b:c: d\r\n"), 200},
      {"obs-text in a value", get("X-A: \xe9\r\n"), 200},
      {"a tab in a value", get("X-A: b\tc\r\n"), 200},
      {"every token byte in a name", get("!#$%&'*+-.^_`|~09azAZ: b\r\n"), 200},
      {"length zero", get("Content-Length: 0\r\n"), 200},
      {"length with leading zeros", get("Content-Length: 000\r\n"), 200},
      {"expects 100-continue without a body", get("Expect: 100-Continue\r\n"), 200},
      {"asks for h2c", get("Connection: Upgrade\r\nUpgrade: h2c\r\n"), 200},
      {"asks for a range", get("Range: bytes=0-9,-5,x\r\n"), 200},
      {"a wild query", target("/?a=b&&=&c?d/e"), 200},
      {"100 fields", get([] {
         string many;
         for (int i = 0; i < 99; ++i) many += "x: y\r\n";
         return many;
       }()),
       200},
  };
}

std::vector<Probe> all() {
  std::vector<Probe> table;
  for (const auto& part :
       {request_lines(), targets(), fields(), hosts(), framing(), unusual_but_right()})
    table.insert(table.end(), part.begin(), part.end());
  return table;
}

}  // namespace

const std::vector<Probe>& probes() {
  static const std::vector<Probe> table = all();
  return table;
}

}  // namespace tind::test
