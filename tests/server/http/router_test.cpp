#include "server/http/router.h"

#include <gtest/gtest.h>

#include "server/http/message/uri.h"

namespace tind::http {
namespace {

struct Nobody : DeferredReply {
  Responder responder() override {
    return Responder([](Reply) {});
  }
  std::string client() const override { return {}; }
};

Handler says(std::string text) {
  return [text](const Request& request, DeferredReply&) {
    std::string body = text;
    for (const auto match : request.matched)
      if (!match.empty()) body += "|" + std::string(match);
    return make_reply(200, "text/plain", body);
  };
}

Router example() {
  Router router;
  router.get("/", says("root"));
  router.get("/terrain/{set}/layer.json", says("layer"));
  router.get("/terrain/{set}/{z}/{x}/{y}.terrain", says("tile"));
  router.get("/viewer/{path...}", says("file"));
  router.get("/both", says("get"));
  router.post("/both", {.max_bytes = 10, .type = ""}, says("post"));
  router.post("/only-post", {.max_bytes = 10, .type = ""}, says("post"));
  return router;
}

std::string ask(const Router& router, Method method, std::string_view path) {
  RequestHead head;
  head.method = method;
  Request request{head, path, {}, {}};
  const auto routed = router.route(request);
  if (const Reply* reply = std::get_if<Reply>(&routed)) {
    const std::string& bytes = reply->payload->bytes;
    const auto allow = bytes.find("Allow: ");
    const bool has = allow != std::string::npos && (allow == 0 || bytes[allow - 1] == '\n');
    return std::to_string(reply->status) +
           (has ? " " + bytes.substr(allow, bytes.find("\r\n", allow) - allow) : "");
  }
  Nobody later;
  const auto reply = (*std::get<Router::Match>(routed).handler)(request, later);
  return std::string(reply->payload->body());
}

TEST(Router, FindsTheRoute) {
  const Router router = example();
  const auto get = [&](std::string_view path) { return ask(router, Method::get, path); };
  EXPECT_EQ(get("/"), "root");
  EXPECT_EQ(get("/terrain/a/layer.json"), "layer|a");
  EXPECT_EQ(get("/terrain/a/1/2/3.terrain"), "tile|a|1|2|3");
  EXPECT_EQ(get("/viewer/a/b.js"), "file|a/b.js");
  EXPECT_EQ(get("/viewer/"), "file");
}

TEST(Router, NothingElseFits) {
  const Router router = example();
  for (const char* path :
       {"//", "/terrain", "/terrain/", "/terrain/a", "/terrain/a/", "/terrain/a/layer.json/",
        "/terrain//layer.json", "/terrain/a/1/2/.terrain", "/terrain/a/1/2/3", "/viewer",
        "/VIEWER/", "/terrain/a/1/2/3.terrain/4", "/terrain/a//2/3.terrain",
        "/terrain/../layer.json/x"})
    EXPECT_EQ(ask(router, Method::get, path), "404") << path;
}

TEST(Router, SaysWhichMethodsThereAre) {
  const Router router = example();
  EXPECT_EQ(ask(router, Method::head, "/"), "root");
  EXPECT_EQ(ask(router, Method::put, "/"), "405 Allow: GET, HEAD, OPTIONS");
  EXPECT_EQ(ask(router, Method::post, "/"), "405 Allow: GET, HEAD, OPTIONS");
  EXPECT_EQ(ask(router, Method::delete_, "/both"), "405 Allow: GET, HEAD, OPTIONS, POST");
  EXPECT_EQ(ask(router, Method::post, "/both"), "post");
  EXPECT_EQ(ask(router, Method::get, "/only-post"), "405 Allow: OPTIONS, POST");
  EXPECT_EQ(ask(router, Method::options, "/both"), "204 Allow: GET, HEAD, OPTIONS, POST");
  EXPECT_EQ(ask(router, Method::options, "*"), "204 Allow: GET, HEAD, OPTIONS");
  EXPECT_EQ(ask(router, Method::options, "/none"), "404");
}

TEST(Router, LetsPagesRemoveNothingWhereAllMayRead) {
  Router router;
  router.get("/job", says("get"));
  router.del("/job", says("gone"));
  const auto of_pages = [&](bool any_origin) {
    RequestHead head;
    head.method = Method::options;
    Request request{head, "/job", {}, {}};
    request.any_origin = any_origin;
    const std::string bytes = std::get<Reply>(router.route(request)).payload->bytes;
    EXPECT_TRUE(bytes.starts_with("Allow: DELETE, GET, HEAD, OPTIONS\r\n")) << bytes;
    constexpr std::string_view kName = "Access-Control-Allow-Methods: ";
    const auto begin = bytes.find(kName) + kName.size();
    return bytes.substr(begin, bytes.find('\r', begin) - begin);
  };
  EXPECT_EQ(of_pages(true), "GET, HEAD, OPTIONS");
  EXPECT_EQ(of_pages(false), "DELETE, GET, HEAD, OPTIONS");
}

TEST(PercentDecode, DecodesOnceAndStrictly) {
  EXPECT_EQ(percent_decode("a%20b+c"), "a b+c");
  EXPECT_EQ(percent_decode("%41%61"), "Aa");
  EXPECT_EQ(percent_decode("%2541"), "%41");
  for (const char* bad :
       {"%", "%4", "%zz", "a%", "%00", "%0d%0a", "%1f", "%7f", "%2f", "%2F", "% 1"})
    EXPECT_FALSE(percent_decode(bad)) << bad;
}

TEST(ParseQuery, KeepsOrderAndEmptyValues) {
  const auto text = [](std::string_view query) {
    const auto parameters = parse_query(query);
    if (!parameters) return std::string("bad");
    std::string out;
    for (const auto& [name, value] : *parameters) out += name + "=" + value + ";";
    return out;
  };
  EXPECT_EQ(text(""), "");
  EXPECT_EQ(text("a=1&b=2"), "a=1;b=2;");
  EXPECT_EQ(text("&&a&b=&=c&a=1=2"), "a=;b=;=c;a=1=2;");
  EXPECT_EQ(text("%61=%62"), "a=b;");
  EXPECT_EQ(text("a=%zz"), "bad");
  EXPECT_EQ(text("crs=http:%2F%2Fa/b"), "crs=http://a/b;") << "a query is no path";
}

}  // namespace
}  // namespace tind::http
