// Keys at every route of the table, and what they are never seen in.

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <sstream>

#include "server/http/message/request_parser.h"
#include "server/services/access/access_gate.h"
#include "server/services/jobs/jobs.h"
#include "terrain/raster/url_reader.h"
#include "tests/server/api/api_fixture.h"
#include "tests/support/program.h"

namespace tind::api {
namespace {

using http::Scope;
using services::Key;

constexpr Scope kScopes[] = {Scope::tiles, Scope::read, Scope::jobs, Scope::admin};

Key key(const std::string& secret, std::vector<Scope> scopes,
        std::vector<std::string> datasets = {}) {
  Key made;
  made.name = "ann";
  made.hash = sha256(secret);
  made.scopes = std::move(scopes);
  made.datasets = std::move(datasets);
  return made;
}

services::AccessRules rules(std::vector<Key> keys, std::vector<Scope> without_a_key = {},
                            services::Rate per_address = {}) {
  return {std::move(keys), std::move(without_a_key), per_address};
}

/// "/terrain/{dataset}/{z}.glb" with names in place.
std::string filled(std::string pattern, const std::string& dataset) {
  for (auto open = pattern.find('{'); open != pattern.npos; open = pattern.find('{', open)) {
    const auto close = pattern.find('}', open);
    const std::string name = pattern.substr(open + 1, close - open - 1);
    pattern.replace(open, close - open + 1,
                    name == "dataset" || name == "collectionId" ? dataset : "0");
  }
  return pattern;
}

class AccessApi : public Api {
 protected:
  AccessApi() {
    auto jobs = services::Jobs::open(dir_.file("jobs"), test::tind_binary(), {});
    EXPECT_TRUE(jobs) << jobs.error().what;
    jobs_ = std::move(*jobs);
    app_.jobs = jobs_.get();
    app_.gate = &gate_;
  }
  ~AccessApi() override {
    if (running_) running_->stop();
    jobs_->stop();
  }

  /// What the router says of it: 0 where the handler is asked.
  static int ask(const http::Router& router, const std::string& method, const std::string& path,
                 const std::string& fields) {
    const std::string text = method + " " + path + " HTTP/1.1\r\nHost: h\r\n" + fields +
                             (method == "POST" ? "Content-Length: 2\r\n"
                                                 "Content-Type: application/json\r\n"
                                               : "") +
                             "\r\n";
    const http::Limits limits;
    http::RequestParser parser(limits);
    EXPECT_EQ(parser.parse(text), http::RequestParser::State::done) << text;
    http::Request request{parser.head(), parser.head().path, {}, {}};
    const auto routed = router.route(request);
    const auto* const reply = std::get_if<http::Reply>(&routed);
    return reply ? reply->status : 0;
  }

  std::unique_ptr<services::Jobs> jobs_;
  services::SystemTime now_ = std::chrono::sys_days(std::chrono::year(2026) / 11 / 23);
  services::Nanoseconds steady_ = 1;
  services::AccessGate gate_{{[this] { return steady_; }, [this] { return now_; }}};
};

TEST_F(AccessApi, EveryRouteAsksForTheRightKey) {
  Key expired = key("expired", {std::begin(kScopes), std::end(kScopes)});
  expired.expires = now_;
  std::vector<Key> keys = {expired};
  for (const Scope scope : kScopes) {
    const std::string name(http::name(scope));
    std::vector<Scope> others;
    for (const Scope other : kScopes)
      if (other != scope) others.push_back(other);
    keys.push_back(key("right-" + name, {scope}));
    keys.push_back(key("own-" + name, {scope}, {"made-up"}));
    keys.push_back(key("scope-" + name, others));
    keys.push_back(key("dataset-" + name, {scope}, {"other"}));
  }
  gate_.set(rules(keys));
  const http::Router router = make_router(app_);
  std::size_t asked = 0;
  for (const http::Router::Route& route : router.routes()) {
    const std::string path = filled(route.pattern, "made-up");
    const auto check = [&](const char* method, const http::Router::Action& action) {
      if (!action) return;
      EXPECT_TRUE(action.described) << route.pattern;
      const Scope scope = action.operation->scope;
      const std::string name(http::name(scope));
      const auto with = [&](const std::string& secret) {
        ++asked;
        const int said =
            ask(router, method, path, secret.empty() ? "" : "X-API-Key: " + secret + "\r\n");
        return said == 401 || said == 403 ? said : 0;
      };
      const bool open = scope == Scope::open;
      const bool of_dataset = route.dataset != std::string::npos;
      const std::string what = std::string(method) + " " + route.pattern;
      EXPECT_EQ(with(""), open ? 0 : 401) << what;
      EXPECT_EQ(with("wrong"), open ? 0 : 401) << what;
      EXPECT_EQ(with("expired"), open ? 0 : 401) << what;
      if (open) return;
      EXPECT_EQ(with("scope-" + name), 403) << what;
      EXPECT_EQ(with("dataset-" + name), of_dataset || !action.operation->heeds_access ? 403 : 0)
          << what;
      EXPECT_EQ(with("own-" + name), of_dataset || action.operation->heeds_access ? 0 : 403)
          << what;
      EXPECT_EQ(with("right-" + name), 0) << what;
    };
    check("GET", route.get);
    check("POST", route.post);
    check("DELETE", route.del);
  }
  EXPECT_GT(asked, 200u);
}

TEST_F(AccessApi, AKeyComesInAnyOfThreeWays) {
  gate_.set(rules({key("secret", {Scope::read})}));
  EXPECT_EQ(get("/datasets", "Authorization: Bearer secret\r\n").status, 200);
  EXPECT_EQ(get("/datasets", "authorization: bearer  secret\r\n").status, 200);
  EXPECT_EQ(get("/datasets", "X-API-Key: secret\r\n").status, 200);
  EXPECT_EQ(get("/datasets?key=secret").status, 200);
  EXPECT_EQ(get("/datasets?a=b&k%65y=s%65cret&c=d").status, 200);
  EXPECT_EQ(get("/datasets?key=").status, 401);
  EXPECT_EQ(get("/datasets", "Authorization: Basic secret\r\n").status, 401);
  const HttpReply none = get("/datasets");
  EXPECT_EQ(none.status, 401);
  EXPECT_EQ(none.headers.at("www-authenticate"), "Bearer realm=\"tind\"");
  EXPECT_EQ(get("/livez").status, 200);
  EXPECT_EQ(get("/nothing").status, 404);
}

TEST_F(AccessApi, SomeScopesMayBeOpen) {
  gate_.set(rules({key("secret", {Scope::read})}, {Scope::tiles}));
  EXPECT_EQ(get("/terrain/made-up/layer.json").status, 200);
  EXPECT_EQ(get("/datasets").status, 401);
  EXPECT_EQ(get("/terrain/made-up/layer.json", "X-API-Key: wrong\r\n").status, 401);
  EXPECT_EQ(get("/terrain/made-up/layer.json", "X-API-Key: secret\r\n").status, 200)
      << "a key takes nothing away";
  gate_.set(rules({key("secret", {Scope::tiles, Scope::read}, {"other"})}, {Scope::tiles}));
  EXPECT_EQ(get("/terrain/made-up/layer.json", "X-API-Key: secret\r\n").status, 200);
  EXPECT_EQ(get("/elevation/made-up?lon=0&lat=0", "X-API-Key: secret\r\n").status, 403);
}

/// Which is how tind itself answers beyond a rate.
TEST(UrlReader, WaitsWhereItAskedTooOften) {
  std::atomic<int> asked = 0;
  http::Router router;
  router.get("/a", [&](const http::Request&, http::DeferredReply&) {
    if (++asked < 3) return http::make_reply(429, "text/plain", "slower", {{"Retry-After", "1"}});
    return http::make_reply(200, "text/plain", "here");
  });
  const test::RunningServer server(router);
  const auto got =
      gdal_url_reader().read("http://127.0.0.1:" + std::to_string(server.port()) + "/a", "*/*", "");
  ASSERT_TRUE(got) << got.error().what;
  EXPECT_EQ(std::string(got->begin(), got->end()), "here");
  EXPECT_EQ(asked, 3);
}

TEST_F(AccessApi, AKeyOfSomeDatasetsSeesNoOther) {
  add_dem();
  gate_.set(rules({key("rainier", {Scope::read, Scope::tiles, Scope::jobs}, {"rainier"}),
                   key("other", {Scope::read, Scope::jobs}, {"made-up"})}));
  const auto names = [&](const std::string& secret) {
    const Json json = Json::parse(get("/datasets?key=" + secret).body, nullptr, false);
    std::vector<std::string> all;
    for (const Json& dataset : json["datasets"]) all.push_back(dataset["name"]);
    return all;
  };
  EXPECT_EQ(names("rainier"), std::vector<std::string>{"rainier"});
  EXPECT_EQ(names("other"), std::vector<std::string>{"made-up"});
  EXPECT_EQ(get("/elevation/rainier?lon=-121.76&lat=46.85&key=rainier").status, 200);
  EXPECT_EQ(get("/elevation/rainier?lon=-121.76&lat=46.85&key=other").status, 403);
  const std::string lookup = "/api/v1/lookup?locations=46.85,-121.76&key=";
  EXPECT_EQ(get(lookup + "rainier").status, 200);
  EXPECT_EQ(get(lookup + "other&dataset=rainier").status, 400);
  EXPECT_EQ(get("/v1/rainier,made-up?locations=46.85,-121.76&key=rainier").status, 403);
  EXPECT_EQ(get("/metrics?key=rainier").status, 403);
  EXPECT_EQ(post("/processes/simplify/execution?key=other",
                 R"({"inputs": {"dataset": "rainier", "max_error": 10}})")
                .status,
            403);
  const auto less = [&](const char* name) {  // whether there is one is nothing it is told
    return post("/processes/difference/execution?key=rainier",
                std::string(R"({"inputs": {"dataset": "rainier", "less": ")") + name + R"("}})");
  };
  for (const char* name : {"made-up", "no-such"}) {
    const HttpReply reply = less(name);
    EXPECT_EQ(reply.status, 403) << name;
    EXPECT_EQ(Json::parse(reply.body)["detail"], "The key is not for the dataset of inputs.less.");
  }
}

TEST_F(AccessApi, WhoAsksTooOftenWaits) {
  Key limited = key("limited", {Scope::read});
  limited.rate = {10, 3};
  gate_.set(rules({limited, key("free", {Scope::read})}, {}, {1, 2}));
  for (int i = 2; i >= 0; --i) {
    const HttpReply reply = get("/datasets?key=limited");
    ASSERT_EQ(reply.status, 200);
    EXPECT_EQ(reply.headers.at("ratelimit"), "\"key\";r=" + std::to_string(i) + ";t=1");
    EXPECT_EQ(reply.headers.at("ratelimit-policy"), "\"key\";q=3;w=1");
  }
  const HttpReply refused = get("/datasets?key=limited");
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.headers.at("retry-after"), "1");
  EXPECT_EQ(get("/datasets?key=free").status, 200);
  EXPECT_EQ(get("/datasets").status, 401);
  EXPECT_EQ(get("/nothing").status, 404);
  EXPECT_EQ(get("/datasets?key=guess").status, 429) << "guesses count against the address";
  EXPECT_EQ(get("/livez").status, 200);
  steady_ += 100'000'000;
  EXPECT_EQ(get("/datasets?key=limited").status, 200);
}

TEST_F(AccessApi, AnotherRateIsAnotherBucket) {
  Key limited = key("limited", {Scope::read});
  limited.rate = {0.05, 2};
  gate_.set(rules({limited}, {Scope::read}, {0.05, 1}));
  for (const char* with : {"?key=limited", ""}) {
    while (get(std::string("/datasets") + with).status == 200) {
    }
    EXPECT_EQ(get(std::string("/datasets") + with).status, 429);
  }
  gate_.set(rules({limited}, {Scope::read}, {0.05, 1}));
  EXPECT_EQ(get("/datasets?key=limited").status, 429) << "what stays as it was keeps it";
  EXPECT_EQ(get("/datasets").status, 429);
  limited.rate = {100, 200};
  gate_.set(rules({limited}, {Scope::read}, {10, 20}));
  EXPECT_EQ(get("/datasets?key=limited").status, 200);
  EXPECT_EQ(get("/datasets").status, 200);
}

TEST_F(AccessApi, WhatTakesAKeyIsForNoSharedCache) {
  const auto cached = [&](const std::string& fields) {
    return get("/terrain/made-up/layer.json", fields).headers.at("cache-control");
  };
  EXPECT_EQ(cached("").find("private"), std::string::npos);
  gate_.set(rules({key("secret", {Scope::tiles})}));
  EXPECT_EQ(cached("X-API-Key: secret\r\n").find("private"), 0u);
  gate_.set(rules({key("secret", {Scope::tiles})}, {Scope::tiles}));
  EXPECT_EQ(cached("X-API-Key: secret\r\n").find("private"), std::string::npos);
}

TEST_F(AccessApi, AJobOfAKeyIsOfNobodyWithoutIt) {
  add_dem();
  gate_.set(rules({key("ann", {Scope::jobs})}, {Scope::jobs}));
  const std::string order = R"({"inputs": {"dataset": "rainier", "max_error": 100}})";
  const auto ask = [&](const std::string& fields) {
    test::HttpClient client(port());
    client.send("POST /processes/simplify/execution HTTP/1.1\r\nHost: h\r\n" + fields +
                "Prefer: respond-async\r\nContent-Type: application/json\r\nContent-Length: " +
                std::to_string(order.size()) + "\r\n\r\n" + order);
    return client.receive().headers.at("location");
  };
  const std::string with = "X-API-Key: ann\r\n", of_ann = ask(with), of_all = ask("");
  EXPECT_EQ(get(of_ann, with).status, 200);
  EXPECT_EQ(get(of_ann).status, 404);
  EXPECT_EQ(get(of_all).status, 200);
  EXPECT_EQ(get(of_all, with).status, 404);
}

TEST_F(AccessApi, AKeyIsNeverSaid) {
  const std::string canary = "canary-7f3a91";
  const auto log = std::make_shared<std::ostringstream>();
  const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(*log);
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", sink));
  gate_.set(rules({key(canary, {Scope::read, Scope::tiles, Scope::admin, Scope::jobs})}));
  http::ServerOptions options;
  options.access_log = true;
  router_ = make_router(app_);
  running_.emplace(router_, options);
  app_.server = &running_->server();
  std::string said;
  const auto ask = [&](const std::string& target, const std::string& fields = "") {
    const HttpReply reply = get(target, fields);
    said += std::to_string(reply.status) + reply.body;
    for (const auto& [name, value] : reply.headers) said += name + value;
    return reply.status;
  };
  EXPECT_EQ(ask("/datasets?key=" + canary), 200);
  EXPECT_EQ(ask("/elevation/made-up?lon=7&key=" + canary + "&lat=900"), 400);
  EXPECT_EQ(ask("/nothing?k%65y=" + canary), 404);
  EXPECT_EQ(ask("/datasets?key=x" + canary), 401);
  EXPECT_EQ(ask("/datasets?key=" + canary + "%zz"), 401);
  EXPECT_EQ(ask("/datasets", "Authorization: Bearer x" + canary + "\r\n"), 401);
  EXPECT_EQ(ask("/metrics", "X-API-Key: " + canary + "\r\n"), 200);
  EXPECT_EQ(ask("/progressive/made-up/0/0/0?nonsense=1&key=" + canary), 400);
  running_->stop();
  spdlog::set_default_logger(before);
  EXPECT_NE(log->str().find("/progressive/made-up/0/0/0?nonsense=1"), std::string::npos)
      << "there is an access log: " << log->str();
  // What was wrong about a key may be said of another name; the key itself, never.
  for (const std::string& text : {said, log->str()}) {
    const auto at = text.find(canary);
    EXPECT_EQ(at, std::string::npos) << text.substr(at - std::min<std::size_t>(at, 80), 160);
  }
}

TEST_F(AccessApi, PagesOfListedOriginsAloneMayReadAnswers) {
  http::ServerOptions options;
  options.origins = {"https://a.example"};
  router_ = make_router(app_);
  running_.emplace(router_, options);
  const auto origin = [&](const std::string& fields) {
    const HttpReply reply = get("/datasets", fields);
    EXPECT_EQ(reply.headers.contains("vary"), true);
    const auto found = reply.headers.find("access-control-allow-origin");
    return found == reply.headers.end() ? std::string() : found->second;
  };
  EXPECT_EQ(origin("Origin: https://a.example\r\n"), "https://a.example");
  EXPECT_EQ(origin("Origin: https://b.example\r\n"), "");
  EXPECT_EQ(origin(""), "");
}

}  // namespace
}  // namespace tind::api
