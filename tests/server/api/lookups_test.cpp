// Heights at the addresses of other services, in their forms.

#include <gmock/gmock.h>

#include <cmath>

#include "proto/polyline.h"
#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

class Lookups : public Api {
 protected:
  void SetUp() override {
    add_dem();
    ASSERT_TRUE(
        services::open_dataset(catalog_, {"desert", {test::testdata("desert.asc")}}, {}, {}));
  }

  HttpReply send(const std::string& target, const std::string& type, const std::string& body) {
    HttpClient client(port());
    client.send("POST " + target + " HTTP/1.1\r\nHost: h\r\nContent-Type: " + type +
                "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive();
  }
  Json asked(const std::string& target) {
    const HttpReply reply = get(target);
    EXPECT_EQ(reply.status, 200) << target << reply.body;
    return Json::parse(reply.body, nullptr, false);
  }
  Json height(double lat, double lon, const std::string& more = "") {
    return asked("/elevation/rainier?lon=" + Json(lon).dump() + "&lat=" + Json(lat).dump() +
                 more)["height_m"];
  }
};

const std::string kTwo = "locations=46.85,-121.76|0,0";

// ---- Open Topo Data ----

TEST_F(Lookups, OpenTopoDataHasItsOwnAnswer) {
  const Json json = asked("/v1/rainier?" + kTwo);
  EXPECT_EQ(json, Json::parse(R"({"results": [
    {"elevation": 4317.0, "location": {"lat": 46.85, "lng": -121.76}, "dataset": "rainier"},
    {"elevation": null, "location": {"lat": 0.0, "lng": 0.0}, "dataset": "rainier"}],
    "status": "OK"})"));
  EXPECT_EQ(json["results"][0]["elevation"], height(46.85, -121.76));
}

TEST_F(Lookups, OpenTopoDataTakesWhatItsClientsSend) {
  const Json plain = asked("/v1/rainier?" + kTwo);
  EXPECT_EQ(asked("/v1/rainier?locations=46.85%2C+-121.76%7C+0%2C0"), plain);
  const std::string line =
      proto::encode_polyline(std::vector<proto::PolylinePlace>{{46.85, -121.76}, {0, 0}}, 5);
  for (const std::string& text : {line, "enc:" + line}) {
    const HttpReply form = send("/v1/rainier", "application/x-www-form-urlencoded",
                                "interpolation=bilinear&locations=" + text);
    EXPECT_EQ(Json::parse(form.body, nullptr, false), plain) << form.body;
    const HttpReply body =
        send("/v1/rainier", "application/json", Json{{"locations", text}}.dump());
    EXPECT_EQ(Json::parse(body.body, nullptr, false), plain) << body.body;
  }
  // As curl sends JSON.
  EXPECT_EQ(Json::parse(send("/v1/rainier", "application/x-www-form-urlencoded",
                             Json{{"locations", line}}.dump())
                            .body,
                        nullptr, false),
            plain);
  EXPECT_EQ(send("/height", "application/x-www-form-urlencoded",
                 R"({"shape": [{"lat": 46.85, "lon": -121.76}]})")
                .status,
            200);
  EXPECT_EQ(send("/api/v1/lookup", "text/plain",
                 R"({"locations": [{"latitude": 46.85, "longitude": -121.76}]})")
                .status,
            200);
  const Json nearest = asked("/v1/rainier?locations=46.8501,-121.7603&interpolation=nearest");
  EXPECT_EQ(nearest["results"][0]["elevation"],
            height(46.8501, -121.7603, "&interpolation=nearest"));
  EXPECT_NE(nearest["results"][0]["elevation"], height(46.8501, -121.7603));
}

TEST_F(Lookups, OpenTopoDataSaysWhatNoHeightIsAsOneWants) {
  EXPECT_EQ(asked("/v1/rainier?nodata_value=-9999&" + kTwo)["results"][1]["elevation"], -9999);
  const Json geojson = asked("/v1/rainier?format=geojson&" + kTwo);
  EXPECT_EQ(geojson["type"], "FeatureCollection");
  EXPECT_EQ(geojson["features"][0]["geometry"]["coordinates"],
            Json::parse("[-121.76, 46.85, 4317.0]"));
  EXPECT_EQ(geojson["features"][1]["properties"]["dataset"], "rainier");
}

TEST_F(Lookups, OpenTopoDataSamplesAWay) {
  const Json json = asked("/v1/rainier?locations=46.8,-121.8|46.9,-121.7&samples=5")["results"];
  ASSERT_EQ(json.size(), 5u);
  EXPECT_EQ(json[4]["location"], Json::parse(R"({"lat": 46.9, "lng": -121.7})"));
  EXPECT_NEAR(json[2]["location"]["lat"].get<double>(), 46.85, 1e-4);
  EXPECT_EQ(json[2]["elevation"], height(json[2]["location"]["lat"], json[2]["location"]["lng"]));
}

TEST_F(Lookups, OfSeveralDatasetsTheFirstWithAHeightAnswers) {
  const Json listed = asked("/datasets");
  const Json desert = listed["datasets"][2];
  ASSERT_EQ(desert["name"], "desert");
  const Json& high = desert["highest"];
  const std::string there = high["lat"].dump() + "," + high["lon"].dump();
  for (const char* names : {"rainier,desert", "desert,rainier"}) {
    const Json json = asked(std::string("/v1/") + names + "?locations=46.85,-121.76|" + there +
                            "|0,0")["results"];
    EXPECT_EQ(json[0]["dataset"], "rainier");
    EXPECT_EQ(json[1]["dataset"], "desert");
    EXPECT_TRUE(json[1]["elevation"].is_number());
    EXPECT_TRUE(json[2]["elevation"].is_null());
  }
}

TEST_F(Lookups, OpenTopoDataRefusesInItsForm) {
  for (const std::string& query :
       {std::string(), std::string("locations="), std::string("locations=91,0"),
        std::string("locations=1,2|x,3"), std::string("locations=1,nan"),
        kTwo + "&interpolation=best", kTwo + "&nodata_value=nan", kTwo + "&format=xml",
        kTwo + "&samples=1", kTwo + "&samples=100001", std::string("locations=_p~i"),
        std::string("locations=%zz")}) {
    const HttpReply reply = get("/v1/rainier?" + query);
    EXPECT_EQ(reply.status, 400) << query;
    const Json json = Json::parse(reply.body, nullptr, false);
    EXPECT_EQ(json["status"], "INVALID_REQUEST") << reply.body;
    EXPECT_FALSE(json["error"].get<std::string>().empty());
  }
  for (const char* name : {"none", "rainier,none", "made-up", ","})
    EXPECT_EQ(get(std::string("/v1/") + name + "?" + kTwo).status, 404) << name;
  EXPECT_EQ(send("/v1/none", "application/json", "{}").status, 404);
  EXPECT_EQ(send("/v1/rainier", "application/json", "[1]").status, 400);
  EXPECT_EQ(send("/v1/rainier", "application/json", R"({"locations": [1]})").status, 400);
}

/// Text repeated to almost the largest body.
std::string many(const std::string& begin, const std::string& part, const std::string& end) {
  std::string body = begin;
  while (body.size() + part.size() < (8u << 20) - 16) body += part;
  return body + end;
}

TEST_F(Lookups, ABodyOfMoreValuesThanPlacesIsNotBuilt) {
  const auto error_of = [&](const std::string& target, const std::string& body) {
    const HttpReply reply = send(target, "application/json", body);
    EXPECT_EQ(reply.status, 400) << target;
    const Json json = Json::parse(reply.body, nullptr, false);
    if (json.contains("errors")) return json["errors"][0]["detail"].get<std::string>();
    return json["error"].get<std::string>();
  };
  const std::string lists = many("[[]", ",[]", "]");  // well formed, and no object
  EXPECT_THAT(error_of("/api/v1/lookup", lists), ::testing::HasSubstr("JSON values"));
  EXPECT_THAT(error_of("/height", lists), ::testing::HasSubstr("JSON values"));
  EXPECT_THAT(error_of("/v1/rainier", lists), ::testing::HasSubstr("JSON values"));
  EXPECT_THAT(error_of("/v1/rainier", many("", "a&", "a")), ::testing::HasSubstr("parameters"));
  EXPECT_THAT(error_of("/elevation/rainier", lists), ::testing::HasSubstr("JSON values"));
  EXPECT_THAT(error_of(
                  "/elevation/rainier", "{\"locations\":[[1,2]" +
                                            [] {
                                              std::string more;
                                              for (int i = 0; i < 100'000; ++i) more += ",[1,2]";
                                              return more;
                                            }() +
                                            "]}"),
              ::testing::HasSubstr("100000 places"));
}

// ---- Google ----

TEST_F(Lookups, GoogleHasItsOwnAnswer) {
  const Json one = asked("/maps/api/elevation/json?key=secret&" + kTwo)["results"];
  EXPECT_EQ(one[0]["elevation"], 4317.0);
  EXPECT_GT(one[0]["resolution"], 50);
  EXPECT_TRUE(one[1]["elevation"].is_null());
  EXPECT_FALSE(one[1].contains("resolution"));
  const Json way = asked("/maps/api/elevation/json?path=46.8,-121.8|46.9,-121.7&samples=3");
  EXPECT_EQ(way["results"].size(), 3u);
  for (const char* query : {"", "path=1,2", "locations=1,2&samples=3", "locations=1,2&path=1,2"})
    EXPECT_EQ(get(std::string("/maps/api/elevation/json?") + query).status, 400) << query;
}

// ---- Open-Elevation ----

TEST_F(Lookups, OpenElevationHasItsOwnAnswer) {
  const Json wanted = Json::parse(R"({"results": [
    {"latitude": 46.85, "longitude": -121.76, "elevation": 4317.0},
    {"latitude": 0.0, "longitude": 0.0, "elevation": null}]})");
  EXPECT_EQ(asked("/api/v1/lookup?" + kTwo), wanted);
  const std::string body = R"({"locations": [{"latitude": 46.85, "longitude": -121.76},
                                             {"latitude": 0, "longitude": 0}]})";
  const HttpReply reply = post("/api/v1/lookup", body);
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(Json::parse(reply.body, nullptr, false), wanted);
  const HttpReply elsewhere = post("/api/v1/lookup?dataset=desert", body);
  EXPECT_TRUE(Json::parse(elsewhere.body)["results"][0]["elevation"].is_null());
  for (const char* wrong : {"", "{}", R"({"locations": []})", R"({"locations": [{"latitude": 1}]})",
                            R"({"locations": [{"latitude": 100, "longitude": 0}]})"}) {
    const HttpReply refused = post("/api/v1/lookup", wrong);
    EXPECT_EQ(refused.status, 400) << wrong;
    EXPECT_FALSE(Json::parse(refused.body)["error"].get<std::string>().empty());
  }
  EXPECT_EQ(get("/api/v1/lookup?dataset=none&" + kTwo).status, 400);
}

// ---- Valhalla ----

TEST_F(Lookups, ValhallaHasItsOwnAnswer) {
  const Json shape = Json::parse(R"([{"lat": 46.85, "lon": -121.76}, {"lat": 46.86, "lon": -121.7},
                                     {"lat": 0, "lon": 0}])");
  const HttpReply reply = post("/height", Json{{"shape", shape}, {"id", "me"}}.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json json = Json::parse(reply.body);
  EXPECT_EQ(json["shape"], shape);
  EXPECT_EQ(json["id"], "me");
  EXPECT_EQ(json["height"][0], 4317);
  EXPECT_TRUE(json["height"][0].is_number_integer());
  EXPECT_TRUE(json["height"][2].is_null());

  const Json exact = Json::parse(
      post("/height", Json{{"shape", shape}, {"range", true}, {"height_precision", 2}}.dump())
          .body);
  const Json& second = exact["range_height"][1];
  EXPECT_NEAR(second[1].get<double>(), height(46.86, -121.7).get<double>(), 0.005);
  EXPECT_NEAR(second[0].get<double>(), 4709, 10);  // by hand: .06 degrees and .01 degrees there
  EXPECT_EQ(exact["range_height"][0][0], 0);
}

TEST_F(Lookups, ValhallaReadsPolylinesAndResamplesThem) {
  const std::vector<proto::PolylinePlace> places = {{46.8, -121.8}, {46.9, -121.7}};
  for (const auto& [format, digits] : {std::pair("polyline6", 6), std::pair("polyline5", 5)}) {
    const Json sent = {{"encoded_polyline", proto::encode_polyline(places, digits)},
                       {"shape_format", format}};
    const HttpReply reply = post("/height", sent.dump());
    const Json json = Json::parse(reply.body);
    EXPECT_EQ(json["encoded_polyline"], sent["encoded_polyline"]);
    EXPECT_NEAR(json["height"][1].get<double>(), height(46.9, -121.7).get<double>(), 0.51);
  }
  Json sent = {{"encoded_polyline", proto::encode_polyline(places, 6)},
               {"range", true},
               {"resample_distance", 1000}};
  const Json json = asked("/height?json=" + sent.dump());
  const Json& list = json["range_height"];
  ASSERT_EQ(list.size(), json["shape"].size());
  EXPECT_EQ(list.size(), 15u);  // 13.5 km
  EXPECT_EQ(list[3][0], 3000);
  EXPECT_LT(list[14][0].get<double>() - list[13][0].get<double>(), 1000);
  EXPECT_EQ(json["shape"][14], Json::parse(R"({"lat": 46.9, "lon": -121.7})"));
}

TEST_F(Lookups, ValhallaRefusesInItsForm) {
  const std::string shape =
      R"("shape": [{"lat": 46.85, "lon": -121.76}, {"lat": 47, "lon": -122}])";
  for (const std::string& body :
       {std::string(), std::string("[]"), std::string("{}"), std::string(R"({"shape": []})"),
        std::string(R"({"shape": [{"lat": 1}]})"),
        std::string(R"({"shape": [{"lat": 91, "lon": 0}]})"),
        "{" + shape + R"(, "resample_distance": 0})",
        "{" + shape + R"(, "resample_distance": 0.1})", "{" + shape + R"(, "height_precision": 3})",
        "{" + shape + R"(, "shape_format": "geojson"})",
        std::string(R"({"encoded_polyline": "_p"})")}) {
    const HttpReply reply = post("/height", body);
    EXPECT_EQ(reply.status, 400) << body;
    const Json json = Json::parse(reply.body, nullptr, false);
    EXPECT_EQ(json["status_code"], 400) << reply.body;
    EXPECT_FALSE(json["error"].get<std::string>().empty());
  }
  EXPECT_EQ(get("/height").status, 400);
  EXPECT_EQ(get("/height?json={}").status, 400);
}

}  // namespace
}  // namespace tind::api
