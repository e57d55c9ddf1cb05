// Heights of many places, in other systems, and as a client of a level sees them.

#include <cmath>
#include <random>
#include <sstream>
#include <stop_token>

#include "server/api/elevation/places.h"
#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

class Elevation : public Api {
 protected:
  void SetUp() override { add_dem(); }

  HttpReply send(const std::string& query, const std::string& type, const std::string& body) {
    HttpClient client(port());
    client.send("POST /elevation/rainier" + query + " HTTP/1.1\r\nHost: h\r\nContent-Type: " +
                type + "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive();
  }
  Json one(double lon, double lat, const std::string& more = "") {
    return Json::parse(
        get("/elevation/rainier?lon=" + Json(lon).dump() + "&lat=" + Json(lat).dump() + more).body);
  }
};

/// Around Mount Rainier and beyond its DEM.
std::vector<std::array<double, 2>> some_places(int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> lon(-122.1, -121.4), lat(46.6, 47.1);
  std::vector<std::array<double, 2>> places;
  for (int i = 0; i < count; ++i) places.push_back({lon(random), lat(random)});
  return places;
}

TEST_F(Elevation, OfManyIsThatOfEach) {
  const auto places = some_places(60);
  const HttpReply reply = send("", "application/json", Json{{"locations", places}}.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(reply.headers.at("content-type"), "application/json");
  const Json many = Json::parse(reply.body);
  EXPECT_EQ(many["datum"], "egm96");
  EXPECT_EQ(many["interpolation"], "bilinear");
  ASSERT_EQ(many["height_m"].size(), places.size());
  int outside = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Json single = one(places[i][0], places[i][1]);
    EXPECT_EQ(many["height_m"][i], single["height_m"]);
    EXPECT_EQ(many["coverage"][i], single["coverage"]);
    outside += single["coverage"] == "outside";
  }
  EXPECT_GT(outside, 0);
  EXPECT_LT(outside, 60);
}

TEST_F(Elevation, GivesGeoJsonItsHeights) {
  const Json sent = Json::parse(R"({"type": "FeatureCollection", "features": [
    {"type": "Feature", "properties": {"name": "way"}, "geometry":
      {"type": "LineString", "coordinates": [[-121.8, 46.8], [-121.75, 46.85, 7], [0, 0]]}},
    {"type": "Feature", "properties": null, "geometry": {"type": "GeometryCollection", "geometries": [
      {"type": "Point", "coordinates": [-121.76, 46.85]},
      {"type": "Polygon", "coordinates": [[[-121.8, 46.8], [-121.7, 46.8], [-121.7, 46.9], [-121.8, 46.8]]]}]}},
    {"type": "Feature", "properties": {}, "geometry": null}]})");
  const HttpReply reply = send("", "application/geo+json", sent.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(reply.headers.at("content-type"), "application/geo+json");
  Json got = Json::parse(reply.body);
  EXPECT_EQ(got["heights"]["datum"], "egm96");
  const Json& line = got["features"][0]["geometry"]["coordinates"];
  for (const Json& position : line)
    EXPECT_EQ(position.size(), 2u) << "beside heights, what lies outside would be at 0 m";
  const Json& all = got["heights"]["height_m"];
  ASSERT_EQ(all.size(), 8u);
  EXPECT_EQ(all[0], one(-121.8, 46.8)["height_m"]);
  EXPECT_EQ(all[1], one(-121.75, 46.85)["height_m"]) << "a height that was sent is replaced";
  EXPECT_TRUE(all[2].is_null());
  const Json& parts = got["features"][1]["geometry"]["geometries"];
  EXPECT_EQ(parts[0]["coordinates"][2], one(-121.76, 46.85)["height_m"]);
  EXPECT_EQ(parts[1]["coordinates"][0][3][2], one(-121.8, 46.8)["height_m"]);
  EXPECT_EQ(got["features"][0]["properties"]["name"], "way");
}

TEST_F(Elevation, OfNothingAreNone) {
  for (const char* const none : {R"({"type": "FeatureCollection", "features": []})",
                                 R"({"type": "Feature", "geometry": null, "properties": {"a": 1}})",
                                 R"({"type": "GeometryCollection", "geometries": []})"}) {
    const HttpReply reply = send("", "application/geo+json", none);
    ASSERT_EQ(reply.status, 200) << none << reply.body;
    Json got = Json::parse(reply.body);
    EXPECT_EQ(got["heights"]["datum"], "egm96");
    got.erase("heights");
    EXPECT_EQ(got, Json::parse(none));
  }
}

TEST_F(Elevation, RepeatsHowGoodHeightsAreSaidToBeWhereThereAreAny) {
  const std::string dem = test::testdata("rainier.tif");
  DemOptions stated;
  stated.accuracy = VerticalAccuracy{AccuracyKind::rmse, 2.5};
  ASSERT_TRUE(services::open_dataset(catalog_, {"stated", {dem}}, stated, {}));
  services::DatasetSpec layers{"layers", {dem, dem}};
  layers.layers = {{"low", {dem}, {{"accuracy", "le90=4"}}}, {"high", {dem}}};
  const auto opened = services::open_dataset(catalog_, layers, {}, {});
  ASSERT_TRUE(opened) << opened.error().what;
  const auto ask = [&](const std::string& query) {
    return Json::parse(get("/elevation/" + query).body);
  };
  const auto ask_many = [&](const std::string& query) {
    return Json::parse(post("/elevation/" + query, R"({"locations": [[-121.76, 46.85]]})").body);
  };
  const std::string there = "?lon=-121.76&lat=46.85", level = "surface=level=9";
  const Json rmse = {{"kind", "rmse"}, {"m", 2.5}};
  const Json of_layers = {{"low", {{"kind", "le90"}, {"m", 4}}}};
  EXPECT_EQ(ask("stated" + there)["accuracy"], rmse);
  EXPECT_EQ(ask("stated" + there + "&" + level)["accuracy"], rmse);
  EXPECT_EQ(ask_many("stated")["accuracy"], rmse);
  EXPECT_EQ(ask_many("stated?" + level)["accuracy"], rmse);
  EXPECT_EQ(ask_many("layers")["accuracy"], of_layers);
  EXPECT_EQ(ask("layers" + there + "&" + level)["accuracy"], of_layers);
  EXPECT_EQ(ask_many("layers?" + level)["accuracy"], of_layers);
  // Outside; a DEM of which nothing is said.
  for (const std::string& none :
       {std::string("stated?lon=0&lat=0"), std::string("layers?lon=0&lat=0"), "rainier" + there})
    EXPECT_FALSE(ask(none).contains("accuracy")) << none;
  EXPECT_FALSE(ask_many("rainier").contains("accuracy"));
}

TEST_F(Elevation, GivesTablesTwoColumns) {
  const std::string sent =
      "\xef\xbb\xbfname, Latitude,\"Longitude\"\r\n\"peak, the\",46.85,-121.76\r\n\r\nfar,0,0\n";
  const HttpReply reply = send("", "text/csv; charset=utf-8", sent);
  ASSERT_EQ(reply.status, 200) << reply.body;
  std::ostringstream expected;
  expected << "name, Latitude,\"Longitude\",height_m,coverage\n\"peak, the\",46.85,-121.76,"
           << one(-121.76, 46.85)["height_m"].dump() << ",value\nfar,0,0,,outside\n";
  EXPECT_EQ(reply.body, expected.str());
}

TEST_F(Elevation, RefusesALineBreakWithinAField) {
  const HttpReply reply =
      send("", "text/csv", "lon,lat,name\n-121.76,46.85,\"a hut\n-121.75,46.85,by the lake\"\n");
  EXPECT_EQ(reply.status, 400) << reply.body;
  EXPECT_NE(reply.body.find("line 2"), std::string::npos) << reply.body;
  EXPECT_NE(reply.body.find("quote"), std::string::npos) << reply.body;
}

/// "lon,lat" and so many more columns, and so many lines that have only these two.
std::string short_lines(std::size_t more_columns, int lines) {
  std::string table = "lon,lat" + std::string(more_columns, ',') + '\n';
  for (int i = 0; i < lines; ++i) table += "-121.76,46.85\n";
  return table;
}

TEST_F(Elevation, OfShortLinesStandsInItsOwnColumns) {
  const HttpReply reply = send("", "text/csv", short_lines(500, 300) + "-121.76,46.85,a\n");
  ASSERT_EQ(reply.status, 200) << reply.body.substr(0, 500);
  const std::string height = one(-121.76, 46.85)["height_m"].dump() + ",value\n";
  std::string expected = "lon,lat" + std::string(501, ',') + "height_m,coverage\n";
  for (int i = 0; i < 300; ++i) expected += "-121.76,46.85" + std::string(501, ',') + height;
  expected += "-121.76,46.85,a" + std::string(500, ',') + height;
  EXPECT_TRUE(reply.body == expected) << reply.body.size() << " bytes, not " << expected.size();
}

TEST_F(Elevation, RefusesATableThatWouldComeBackAsCommas) {
  const std::size_t just = kMostLacking / 64;
  EXPECT_EQ(send("", "text/csv", short_lines(just, 64)).status, 200);
  for (const std::string& table :
       {short_lines(just, 65), short_lines(50'000, 2000), short_lines(7'000'000, 2)}) {
    const HttpReply reply = send("", "text/csv", table);
    ASSERT_EQ(reply.status, 400) << reply.body.size();
    const Json wrong = Json::parse(reply.body)["errors"];
    ASSERT_EQ(wrong.size(), 1u) << wrong;
    EXPECT_EQ(wrong[0]["parameter"], "body");
    EXPECT_NE(wrong[0]["detail"].dump().find(std::to_string(kMostLacking)), std::string::npos);
  }
}

TEST_F(Elevation, RefusesAnObjectOfVeryManyMembers) {
  const auto names = [](int count) {
    Json members;
    for (int i = 0; i < count; ++i) members[std::to_string(i)] = i;
    return members;
  };
  Json point = {{"type", "Feature"},
                {"properties", names(1000)},
                {"geometry", {{"type", "Point"}, {"coordinates", {-121.76, 46.85}}}}};
  EXPECT_EQ(send("", "application/geo+json", point.dump()).status, 200);
  point["properties"] = names(50'000);
  Json list = names(50'000);
  list["locations"] = {{-121.76, 46.85}};
  for (const Json& sent : {point, list}) {
    const HttpReply reply = send("", "application/json", sent.dump());
    ASSERT_EQ(reply.status, 400) << reply.body.size();
    const Json wrong = Json::parse(reply.body)["errors"];
    ASSERT_EQ(wrong.size(), 1u) << wrong;
    EXPECT_EQ(wrong[0]["parameter"], "body");
    EXPECT_NE(wrong[0]["detail"].dump().find("1000 members"), std::string::npos) << wrong;
  }
}

TEST_F(Elevation, ReadsOnlyAsLongAsSomebodyWaits) {
  std::stop_source stop;
  const std::pair<std::string, std::string> bodies[] = {
      {"text/csv", "lon,lat\n1,x\n"},
      {"application/json", R"({"locations": [[1, "x"]]})"},
      {"application/geo+json", R"({"type": "Point", "coordinates": [1, "x"]})"}};
  for (const auto& [type, body] : bodies)
    EXPECT_EQ(PlacesDocument::read(type, body, "", "/", stop.get_token()).error().status, 400);
  stop.request_stop();
  for (const auto& [type, body] : bodies)
    EXPECT_EQ(PlacesDocument::read(type, body, "", "/", stop.get_token()).error().status,
              http::status_of(Errc::cancelled));
}

TEST_F(Elevation, OfALevelHasNoInterpolationOfItsOwn) {
  const std::string there = "/elevation/rainier?lon=-121.76&lat=46.85&surface=level=9";
  EXPECT_EQ(get(there + "&interpolation=bilinear").status, 200);
  for (const char* how : {"nearest", "cubic"}) {
    const HttpReply reply = get(there + "&interpolation=" + how);
    EXPECT_EQ(reply.status, 400) << how;
    EXPECT_EQ(Json::parse(reply.body)["errors"][0]["parameter"], "interpolation");
  }
}

TEST_F(Elevation, OfLayersFromDifferentDatumsIsAboveTheOneThatTheyWereBroughtTo) {
  const std::string low = test::testdata("rainier.tif"), high = dir_.file("high.asc");
  std::ofstream(high) << "ncols 3\nnrows 3\nxllcenter -121.77\nyllcenter 46.84\ncellsize 0.01\n"
                         "2000 2000 2000\n2000 2000 2000\n2000 2000 2000\n";
  services::DatasetSpec spec{"layers", {low, high}};
  spec.layers = {{"low", {low}, {{"from_datum", "egm96"}}},
                 {"high", {high}, {{"from_datum", "ellipsoid"}, {"crs", "EPSG:4326"}}}};
  const auto every = services::dataset_options({{"to-datum", "ellipsoid"}}, {});
  ASSERT_TRUE(every) << every.error().what;
  services::DatasetOptions options = *every;
  options.dem.environment = environment_;
  auto opened = services::open_dataset(spec, options);
  ASSERT_TRUE(opened) << opened.error().what;
  ASSERT_EQ(opened->recipes.size(), 2u);
  EXPECT_EQ(opened->recipes[0].words.at("from-datum"), "egm96") << "for who opens it anew";
  EXPECT_EQ(opened->recipes[1].words.at("from-datum"), "ellipsoid");
  catalog_.add("layers", std::move(*opened));
  const auto ask = [&](const std::string& query) {
    return Json::parse(get("/elevation/layers?" + query).body);
  };
  const Json in_high = ask("lon=-121.76&lat=46.85");
  EXPECT_EQ(in_high["height_m"], 2000);
  EXPECT_EQ(in_high["datum"], "ellipsoid");
  const Json in_low = ask("lon=-121.9&lat=46.85");
  EXPECT_EQ(in_low["datum"], "ellipsoid");
  EXPECT_EQ(in_low["height_m"], ask("lon=-121.9&lat=46.85&datum=ellipsoid")["height_m"]);
  const Json many = Json::parse(
      post("/elevation/layers", R"({"locations": [[-121.9, 46.85], [-121.76, 46.85]]})").body);
  EXPECT_EQ(many["datum"], "ellipsoid");
  const Json position = Json::parse(
      get("/collections/layers/position?coords=POINT(-121.76%2046.85)&f=CoverageJSON").body);
  EXPECT_NE(position.dump().find("above ellipsoid"), std::string::npos);
}

TEST_F(Elevation, KnowsOtherSystems) {
  // UTM zone 10 north; EPSG:4326 has the latitude first.
  const Json geographic = one(-121.76, 46.85);
  const Json turned =
      Json::parse(get("/elevation/rainier?crs=EPSG:4326&coords=46.85,-121.76").body);
  EXPECT_NEAR(turned["height_m"].get<double>(), geographic["height_m"].get<double>(), 1e-6);
  EXPECT_NE(turned["axes"][0].get<std::string>().find("north"), std::string::npos);
  const Json utm =
      Json::parse(get("/elevation/rainier?crs=EPSG:32610&coords=594530.2,5189412.1").body);
  EXPECT_EQ(utm["coverage"], "value") << utm.dump();
  EXPECT_EQ(utm["axes"][0], "Easting (east)");
  const Json same = one(utm["lon"], utm["lat"]);
  EXPECT_NEAR(utm["height_m"].get<double>(), same["height_m"].get<double>(), 1e-3);
  // Columns have names, so a table has no order of axes.
  for (const char* head : {"lat,lon\n46.85,-121.76\n", "x,y\n-121.76,46.85\n"}) {
    const HttpReply table = send("?crs=EPSG:4326", "text/csv", head);
    ASSERT_EQ(table.status, 200) << table.body;
    const std::string row = table.body.substr(table.body.find('\n') + 1);
    EXPECT_NEAR(std::stod(row.substr(row.find(',', row.find(',') + 1) + 1)),
                geographic["height_m"].get<double>(), 1e-6);
  }
}

TEST_F(Elevation, OfALevelIsWithinItsBoundOfThePosts) {
  const Json summit = Json::parse(get("/datasets").body)["datasets"][1]["highest"];
  const double lon = summit["lon"], lat = summit["lat"], post = summit["height_m"];
  double last = HUGE_VAL;
  for (const int level : {7, 9, 24}) {
    const Json seen = one(lon, lat, "&surface=level=" + std::to_string(level));
    EXPECT_EQ(seen["coverage"], "value") << seen.dump();
    ASSERT_TRUE(seen.contains("max_error_m")) << seen.dump();
    const double bound = seen["max_error_m"];
    EXPECT_LE(std::abs(seen["height_m"].get<double>() - post), bound + 1e-6);
    EXPECT_LE(bound, last);
    last = bound;
    EXPECT_FALSE(seen["tile"].get<std::string>().empty());
  }
  EXPECT_EQ(get("/elevation/made-up?lon=1&lat=1&surface=level=3").status, 200)
      << "a store has meshes";
}

TEST_F(Elevation, OfALevelABandHoldsTheDemsAlsoBetweenPosts) {
  int beyond = 0, bands = 0;
  for (const auto& [lon, lat] : some_places(250)) {
    const Json truth = one(lon, lat), seen = one(lon, lat, "&surface=level=9");
    if (truth["coverage"] != "value") continue;
    const double height = truth["height_m"], mesh = seen["height_m"], error = seen["max_error_m"];
    beyond += std::abs(mesh - height) > error;
    if (!seen.contains("low_m")) continue;  // beside a void
    ++bands;
    EXPECT_LE(seen["low_m"], height) << seen;
    EXPECT_GE(seen["high_m"], height) << seen;
    EXPECT_LE(seen["high_m"].get<double>() - seen["low_m"].get<double>(), 2 * error + 0.01);
  }
  EXPECT_GT(bands, 100);
  RecordProperty("beyond_max_error", beyond);
  EXPECT_FALSE(one(-121.76, 46.85).contains("low_m"));
}

TEST_F(Elevation, ManyOfALevelHaveTheBandsOfEach) {
  const auto places = some_places(60);
  std::string csv = "lon,lat\n";
  for (const auto& [lon, lat] : places) csv += Json(lon).dump() + "," + Json(lat).dump() + "\n";
  const HttpReply reply =
      send("?surface=level=9", "application/json", Json{{"locations", places}}.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json many = Json::parse(reply.body);
  const HttpReply lines = send("?surface=level=9", "text/csv", csv);
  ASSERT_EQ(lines.status, 200) << lines.body;
  std::istringstream table(lines.body);
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line, "lon,lat,height_m,coverage,max_error_m,low_m,high_m");
  int bands = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Json alone = one(places[i][0], places[i][1], "&surface=level=9");
    std::getline(table, line);
    for (const char* key : {"height_m", "max_error_m", "low_m", "high_m"})
      EXPECT_EQ(many[key][i], alone.contains(key) ? alone[key] : Json()) << key << " " << alone;
    if (!alone.contains("low_m")) {
      EXPECT_TRUE(line.ends_with(",,")) << line;
      continue;
    }
    ++bands;
    EXPECT_TRUE(line.ends_with("," + alone["low_m"].dump() + "," + alone["high_m"].dump())) << line;
  }
  EXPECT_GT(bands, 30);
}

TEST_F(Elevation, InterpolatesAsAsked) {
  const Json bilinear = one(-121.7603, 46.8529),
             nearest = one(-121.7603, 46.8529, "&interpolation=nearest"),
             cubic = one(-121.7603, 46.8529, "&interpolation=cubic");
  EXPECT_EQ(nearest["interpolation"], "nearest");
  EXPECT_NE(bilinear["height_m"], cubic["height_m"]);
  EXPECT_EQ(nearest["height_m"].get<double>(), std::round(nearest["height_m"].get<double>()))
      << "the posts are whole metres";
}

TEST_F(Elevation, NamesWhatIsWrongWithManyPlaces) {
  struct Case {
    std::string query, type, body, parameter;
  };
  const std::string json = "application/json", good = R"({"locations": [[-121.76, 46.85]]})";
  for (const Case& wrong : {
           Case{"", json, "{", "body"},
           Case{"", json, "[]", "body"},
           Case{"", json, "{}", "locations"},
           Case{"", json, R"({"locations": []})", "locations"},
           Case{"", json, R"({"locations": [[1, 2], [1]]})", "locations[1]"},
           Case{"", json, R"({"locations": [[1, 2, 3]]})", "locations[0]"},
           Case{"", json, R"({"locations": [[0, 91]]})", "locations[0]"},
           Case{"", json, R"({"locations": [[1, 1]], "more": 1})", "more"},
           Case{"", json, R"({"locations": [[1, 1]], "locations": [[2, 2]]})", "locations"},
           Case{"", json, R"({"type": "Point", "coordinates": [1, 2], "a": 1, "a": 2})", "a"},
           Case{"?crs=EPSG:5703", json, good, "crs"},
           Case{"?crs=WGS84", json, good, "crs"},
           Case{"?surface=level=25", json, good, "surface"},
           Case{"?interpolation=best", json, good, "interpolation"},
           Case{"?datum=EPSG:4326", json, good, "datum"},
           Case{"?lon=1", json, good, "lon"},
           Case{"", json, R"({"type": "Point"})", "coordinates"},
           Case{"", json, R"({"type": "Point", "coordinates": ["1", 2]})", "coordinates"},
           Case{"", "text/csv", "", "body"},
           Case{"", "text/csv", "a,b\n1,2\n", "body"},
           Case{"", "text/csv", "lon,lat\n", "body"},
           Case{"", "text/csv", "lon,lat,lon\n1,2,3\n", "body"},
           Case{"", "text/csv", "lon,lat,longitude\n1,2,3\n", "body"},
           Case{"?crs=EPSG:32610", "text/csv", "x,y,lon\n1,2,3\n", "body"},
           Case{"", "text/csv", "lon,lat,\"name\n1,2,x\n", "line 1"},
           Case{"", "text/csv", "lon,lat\n1,2\n1,x\n", "line 3"},
       }) {
    const HttpReply reply = send(wrong.query, wrong.type, wrong.body);
    ASSERT_EQ(reply.status, 400) << wrong.body << reply.body;
    EXPECT_EQ(Json::parse(reply.body)["errors"][0]["parameter"], wrong.parameter) << wrong.body;
  }
  EXPECT_EQ(send("", "text/plain", good).status, 415);
  EXPECT_EQ(send("", json, std::string(9u << 20, ' ')).status, 413);
}

TEST_F(Elevation, NamesWhatIsWrongWithOnePlace) {
  for (const auto& [query, parameter] :
       {std::pair("crs=EPSG:2056", "coords"), std::pair("coords=1", "coords"),
        std::pair("coords=1,2&lon=3", "coords"), std::pair("crs=EPSG:4326&coords=95,0", "coords"),
        std::pair("crs=EPSG:3857&coords=1e300,0", "coords"),
        std::pair("crs=EPSG:9999999&coords=1,2", "crs"),
        std::pair("crs=EPSG:999999&coords=1,2", "crs"),
        std::pair("lon=1&lat=2&surface=mesh", "surface")}) {
    const HttpReply reply = get(std::string("/elevation/rainier?") + query);
    ASSERT_EQ(reply.status, 400) << query << reply.body;
    EXPECT_EQ(Json::parse(reply.body)["errors"][0]["parameter"], parameter) << query;
  }
}

}  // namespace
}  // namespace tind::api
