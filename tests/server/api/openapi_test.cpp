#include "server/api/openapi/openapi.h"

#include <set>

#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

class OpenApi : public Api {};

TEST_F(OpenApi, EveryRouteSaysWhatItDoes) {
  const http::Router router = make_router(app_);
  std::set<std::string> ids;
  for (const http::Router::Route& route : router.routes())
    for (const http::Router::Action* action : {&route.get, &route.post, &route.del}) {
      if (!*action) continue;
      ASSERT_TRUE(action->described) << route.pattern;
      const http::Operation& operation = *action->operation;
      if (operation.is_hidden) continue;
      EXPECT_TRUE(ids.insert(operation.id).second) << operation.id;
      EXPECT_FALSE(operation.summary.empty()) << route.pattern;
      EXPECT_FALSE(operation.responses.empty()) << route.pattern;
      EXPECT_EQ(action == &route.post, !operation.body.empty()) << route.pattern;
      const bool any_type = action != &route.post || route.body.type.empty();
      for (const http::Content& form : operation.body)
        EXPECT_TRUE(any_type || route.body.type.find(form.type) != std::string_view::npos)
            << route.pattern;
    }
  EXPECT_GT(ids.size(), 30u);
}

TEST_F(OpenApi, IsServedAsJsonAndAsYaml) {
  const HttpReply json = get("/openapi.json"), yaml = get("/openapi.yaml");
  ASSERT_EQ(json.status, 200);
  EXPECT_EQ(json.headers.at("content-type"), "application/vnd.oai.openapi+json;version=3.1");
  EXPECT_EQ(yaml.headers.at("content-type"), "application/yaml");
  const Ordered document = Ordered::parse(json.body, nullptr, false);
  EXPECT_EQ(document["openapi"], "3.1.0");
  EXPECT_EQ(yaml.body, to_yaml(document));
  const Ordered& lon = document["paths"]["/elevation/{dataset}"]["get"]["parameters"][1];
  EXPECT_EQ(lon["name"], "lon");
  EXPECT_EQ(lon["schema"]["maximum"], 360);
  // What has a validator may find that it is another by now.
  EXPECT_EQ(get("/openapi.json", "If-Match: \"x\"\r\n").status, 412);
  int validated = 0;
  for (const auto& [path, operations] : document["paths"].items())
    for (const auto& [method, operation] : operations.items())
      if (operation["responses"].contains("304")) {
        EXPECT_TRUE(operation["responses"].contains("412")) << path;
        ++validated;
      }
  EXPECT_GT(validated, 20);
  EXPECT_TRUE(document["components"]["responses"].contains("412"));
}

TEST(Yaml, QuotesWhatCouldBeSomethingElse) {
  const Ordered json = Ordered::parse(
      R"({"a": ["b", "no", "1", "x: y", 2, true, null, {}, [], {"200": "c d"}], "e": {"f": [[1]]}})");
  EXPECT_EQ(to_yaml(json),
            "a:\n  - b\n  - \"no\"\n  - \"1\"\n  - \"x: y\"\n  - 2\n  - true\n  - null\n  - {}\n"
            "  - []\n  -\n    \"200\": \"c d\"\ne:\n  f:\n    -\n      - 1\n");
}

}  // namespace
}  // namespace tind::api
