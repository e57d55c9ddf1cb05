#pragma once
// What tests of OGC API have in common.

#include <cmath>

#include "tests/server/api/api_fixture.h"

namespace tind::api {

class Ogc : public Api {
 protected:
  void SetUp() override { add_dem(); }

  Json json(const std::string& target) {
    const HttpReply reply = get(target, "Accept: application/json\r\n");
    EXPECT_EQ(reply.status, 200) << target << reply.body;
    return Json::parse(reply.body, nullptr, false);
  }
  /// Null where there is no height.
  Json height(double lon, double lat) {
    return json("/elevation/rainier?lon=" + Json(lon).dump() +
                "&lat=" + Json(lat).dump())["height_m"];
  }
  /// The first link of that relation and type; empty: there is none.
  static std::string href(const Json& document, const std::string& rel, const std::string& type) {
    for (const Json& link : document.at("links"))
      if (link.at("rel") == rel && link.at("type") == type) return link.at("href");
    return {};
  }
  /// A 400 whose first problem is this parameter's.
  void expect_wrong(const std::string& target, const std::string& parameter) {
    const HttpReply reply = get(target);
    EXPECT_EQ(reply.status, 400) << target << reply.body;
    const Json problem = Json::parse(reply.body, nullptr, false);
    ASSERT_TRUE(problem.contains("errors")) << target << reply.body;
    EXPECT_EQ(problem["errors"][0]["parameter"], parameter) << target << reply.body;
  }
};

}  // namespace tind::api
