// What the daemon says of itself and of its datasets: layer.json, methods, elevation, flights, the
// viewer, health.

// Under the sanitizers g++ 12 takes members of <regex>'s automaton for uninitialised (GCC 105562).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <gtest/gtest.h>

#include <future>
#include <regex>
#include <thread>

#include "server/api/methods.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/simplify/methods.h"
#include "tests/server/api/api_fixture.h"
#include "tests/support/made_up_source.h"

namespace tind::api {
namespace {

const std::string kTile = "/terrain/made-up/3/5/2.terrain";

TEST_F(Api, AFlightIsPlanned) {
  const HttpReply reply =
      post("/plan/made-up", R"({"position":{"lon":7,"lat":46,"height_m":3000},)"
                            R"("velocity":{"east":250},"horizon_s":300,"link_bits_per_s":1e7})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json plan = Json::parse(reply.body);
  ASSERT_GT(plan["tiles"].size(), 10u);
  EXPECT_EQ(plan["tiles"][0]["tile"], "0/0/0");
  EXPECT_GT(plan["lead_s"].get<double>(), 0);

  expect_refused(
      "/plan/made-up",
      {{"", "body"},
       {"[]", "body"},
       {"{}", "position"},
       {R"({"trajectory":[]})", "trajectory"},
       {R"({"trajectory":[)" + std::string(100'100, ',') + "]}", "body"},
       {R"({"trajectory":[{"lon":1}]})", "trajectory[0].lat"},
       {R"({"trajectory":[7]})", "trajectory[0]"},
       {R"({"trajectory":[{"lon":1,"lat":1,"height_m":1,"time_s":9},{"lon":1,"lat":1,"height_m":1,"time_s":8}]})",
        "trajectory[1].time_s"},
       {R"({"trajectory":[{"lon":1,"lat":1,"height_m":1,"time_s":9}],"horizon_s":1})", "horizon_s"},
       {R"({"position":{"lon":7,"lat":46,"height_m":3},"horizon_s":1,"speed":2})", "speed"},
       {R"({"position":{"lon":7,"lat":90,"height_m":3},"velocity":{"east":9},"horizon_s":99})",
        "velocity"},
       {R"({"position":{"lon":7,"lat":46,"height_m":3},"velocity":{"down":2},"horizon_s":1})",
        "velocity.down"},
       {R"({"position":{"lon":7,"lat":46,"height_m":3}})", "horizon_s"},
       {R"({"position":{"lon":7,"lat":46,"height_m":3},"horizon_s":1,"tolerance_px":0})",
        "tolerance_px"},
       {R"({"position":{"lon":7,"lat":460,"height_m":3},"horizon_s":1})", "position.lat"}});
}

TEST_F(Api, LayerJsonAndDatasets) {
  const HttpReply layer = get("/terrain/made-up/layer.json");
  EXPECT_EQ(layer.headers.at("content-type"), "application/json");
  EXPECT_EQ(Json::parse(layer.body)["format"], "quantized-mesh-1.0");
  EXPECT_EQ(
      get("/terrain/made-up/layer.json", "If-None-Match: " + layer.headers.at("etag") + "\r\n")
          .status,
      304);
  add_dem();
  running_.reset();
  const Json list = Json::parse(get("/datasets").body)["datasets"];
  for (const Json& dataset : list) EXPECT_EQ(dataset["state"], "ready");
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0]["name"], "made-up");
  EXPECT_EQ(list[0]["kind"], "store");
  EXPECT_EQ(list[1]["name"], "rainier");
  EXPECT_EQ(list[1]["kind"], "dem");
  EXPECT_EQ(list[1]["links"]["layer"], "/terrain/rainier/layer.json");
  EXPECT_GT(list[1]["max_level"], 8);
  EXPECT_LT(list[1]["bounds"][0], -121.7);
  EXPECT_GT(list[1]["bounds"][2], -121.8);
  EXPECT_EQ(list[1]["box"], list[1]["bounds"]);
  EXPECT_EQ(list[1]["source"]["driver"], "GTiff");
  EXPECT_TRUE(list[0]["highest"].is_null()) << "tiles say no place";
}

TEST_F(Api, LinksOfADatasetWork) {
  add_dem();
  const Json list = Json::parse(get("/datasets").body);
  for (const Json& dataset : list["datasets"]) {
    const std::string tile = dataset["name"] == "rainier" ? "10/331/778" : "3/5/2";
    const auto fill = [&](std::string link) {
      const std::pair<std::string, std::string> values[] = {
          {"{z}/{x}/{y}", tile},
          {"{ten}/{one}", "w130n40/w122n46"},
          {"{?lon,lat,datum}", "?lon=-121.76&lat=46.85"},
          {"{level}{&lon,lat,datum}", "3&lon=-121.76&lat=46.85"},
          {"{?encoding,format,surface}", "?encoding=terrarium&surface=mesh"},
          {"{&encoding,format}", "&encoding=terrarium&format=webp"},
          {"{?style,azimuth,altitude,z_factor,format}", "?style=slope"}};
      for (const auto& [hole, value] : values)
        if (const auto at = link.find(hole); at != link.npos) link.replace(at, hole.size(), value);
      return link;
    };
    EXPECT_EQ(dataset["links"].size(), dataset["kind"] == "dem" ? 13u : 10u);
    for (const auto& [name, link] : dataset["links"].items()) {
      const bool posts = name == "plan" || name == "tiles_in_frames" || name == "refine";
      if (posts)
        EXPECT_EQ(post(link, "{}").status, 400) << name;  // there, and asks for more
      else
        EXPECT_EQ(get(fill(link)).status, 200) << name << " " << fill(link);
    }
  }
}

TEST_F(Api, ADemWithoutTilesAnswersQuestionsOnly) {
  catalog_.add("posts", dataset_of(std::make_shared<test::MadeUpSource>(
                            HeightGrid(80, 80, 100), Geographic{-122, 47}, 0.01)));
  const Json listed = Json::parse(get("/datasets").body)["datasets"].back();
  EXPECT_EQ(listed["name"], "posts");
  EXPECT_EQ(listed["kind"], "dem");
  EXPECT_EQ(listed["bounds"][0], -122);
  EXPECT_EQ(listed["state"], "ready");
  EXPECT_FALSE(listed.contains("max_level"));
  EXPECT_FALSE(listed["links"].contains("tiles"));
  EXPECT_TRUE(listed["links"].contains("elevation"));
  EXPECT_EQ(listed["links"]["height_images"], "/rgb/posts/tiles.json{?encoding,format}");
  EXPECT_EQ(Json::parse(get("/elevation/posts?lon=-121.76&lat=46.85").body)["height_m"], 100);
  for (const std::string target :
       {"/terrain/posts/layer.json", "/terrain/posts/0/0/0.terrain", "/terrain/posts/0/0/0.glb",
        "/progressive/posts/0/0/0", "/transition/posts/1/0/0"})
    EXPECT_EQ(get(target).status, 404) << target;
  EXPECT_EQ(post("/plan/posts", "{}").status, 404);
}

TEST_F(Api, ElevationSaysWhatItIsAbove) {
  DemOptions egm96;
  egm96.from_datum = VerticalDatum::egm96, egm96.to_datum = TargetDatum::ellipsoid;
  egm96.environment = environment_;
  ASSERT_TRUE(
      services::open_dataset(catalog_, {"converted", {test::testdata("rainier.tif")}}, egm96, {}));
  ASSERT_TRUE(
      services::open_dataset(catalog_, {"as-stored", {test::testdata("rainier.tif")}}, {}, {}));
  catalog_.add("unknown", *dem_dataset(std::make_shared<test::MadeUpSource>(
                                           HeightGrid(80, 80, 100), Geographic{-122, 47}, 0.01),
                                       {}));
  const auto ask = [&](const std::string& dataset, const std::string& datum) {
    return get("/elevation/" + dataset + "?lon=-121.76&lat=46.85" + datum);
  };
  const Json as_stored = Json::parse(ask("as-stored", "").body);
  EXPECT_EQ(as_stored["datum"], "egm96") << "the file says so";
  EXPECT_EQ(Json::parse(ask("unknown", "").body)["datum"], "unknown");
  const Json own = Json::parse(ask("converted", "").body);
  EXPECT_EQ(own["datum"], "egm96");
  EXPECT_NEAR(own["height_m"].get<double>(), as_stored["height_m"].get<double>(), 2e-3);
  EXPECT_EQ(Json::parse(ask("converted", "&datum=source").body), own);
  const Json above = Json::parse(ask("converted", "&datum=ellipsoid").body);
  EXPECT_EQ(above["datum"], "ellipsoid");
  const Json made_above = Json::parse(ask("as-stored", "&datum=ellipsoid").body);
  EXPECT_NEAR(above["height_m"].get<double>(), made_above["height_m"].get<double>(), 2e-3);
  const double undulation = (*environment_->egm96())->undulation({-121.76, 46.85});
  EXPECT_LT(undulation, -10);
  EXPECT_NEAR(above["height_m"].get<double>() - own["height_m"].get<double>(), undulation, 2e-3);
  EXPECT_EQ(Json::parse(ask("as-stored", "&datum=egm96").body)["height_m"], as_stored["height_m"]);
  EXPECT_EQ(Json::parse(ask("as-stored", "&datum=EGM96").body)["datum"], "egm96");
  EXPECT_EQ(Json::parse(ask("as-stored", "&datum=Ellipsoid").body)["datum"], "ellipsoid");
  EXPECT_EQ(Json::parse(ask("converted", "&datum=epsg:5773").body)["datum"], "egm96");
  const Json by_code = Json::parse(ask("converted", "&datum=EPSG:5773").body);
  EXPECT_EQ(by_code["datum"], "egm96");
  EXPECT_EQ(by_code["height_m"], own["height_m"]);
  for (const auto& [dataset, datum] :
       {std::pair("unknown", "&datum=ellipsoid"), std::pair("converted", "&datum=geoid"),
        std::pair("converted", "&datum=EPSG:4326"), std::pair("converted", "&datum=EPSG:5703"),
        std::pair("converted", "&datum=/etc/geoid.gtx"), std::pair("unknown", "&datum=EPSG:5773"),
        std::pair("converted", "&datum=source&datum=source"), std::pair("converted", "&datum=")}) {
    const HttpReply refused = ask(dataset, datum);
    EXPECT_EQ(refused.status, 400) << datum;
    EXPECT_EQ(Json::parse(refused.body)["errors"][0]["parameter"], "datum") << datum;
  }
}

TEST_F(Api, DatasetsSayWhereTheSummitIs) {
  add_dem();
  const Json rainier = Json::parse(get("/datasets").body)["datasets"][1];
  EXPECT_NEAR(rainier["highest"]["lon"].get<double>(), -121.7597, 0.005);
  EXPECT_NEAR(rainier["highest"]["lat"].get<double>(), 46.8526, 0.005);
  for (const char* end : {"highest", "lowest"}) {
    const Json& place = rainier[end];
    const Json there = Json::parse(
        get("/elevation/rainier?lon=" + place["lon"].dump() + "&lat=" + place["lat"].dump()).body);
    EXPECT_NEAR(place["height_m"].get<double>(), there["height_m"].get<double>(), 1e-3) << end;
  }
  EXPECT_GT(rainier["highest"]["height_m"], rainier["lowest"]["height_m"]);
}

TEST_F(Api, MethodsAsTheCommandPrintsThem) {
  const HttpReply reply = get("/methods");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, methods_json());
  const Json list = Json::parse(reply.body);
  ASSERT_EQ(list.size(), methods().size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    EXPECT_EQ(list[i]["name"], methods()[i].name);
    for (const char* key : {"minimises", "stops", "guarantees", "source"})
      EXPECT_FALSE(list[i][key].get<std::string>().empty()) << key;
  }
}

TEST_F(Api, ElevationSaysWhatItFound) {
  add_dem();
  const auto ask = [&](const std::string& query) { return get("/elevation/rainier?" + query); };
  const Json summit = Json::parse(ask("lon=-121.7603&lat=46.8529").body);
  EXPECT_EQ(summit["coverage"], "value");
  EXPECT_NEAR(summit["height_m"].get<double>(), 4392, 60);
  EXPECT_EQ(summit["source"], "rainier");
  EXPECT_TRUE(summit["datum"].is_string());
  const Json outside = Json::parse(ask("lon=0&lat=0").body);
  EXPECT_EQ(outside["coverage"], "outside");
  EXPECT_TRUE(outside["height_m"].is_null());
}

TEST_F(Api, ElevationNamesTheWrongParameter) {
  add_dem();
  struct Case {
    std::string query, parameter;
  };
  for (const Case& wrong :
       {Case{"", "lon"}, Case{"lon=1", "lat"}, Case{"lat=1", "lon"}, Case{"lon=x&lat=1", "lon"},
        Case{"lon=1&lat=91", "lat"}, Case{"lon=1&lat=nan", "lat"}, Case{"lon=inf&lat=1", "lon"},
        Case{"lon=1&lat=1&lat=2", "lat"}, Case{"lon=1&lat=1&z=3", "z"}, Case{"lon=1 &lat=1", ""},
        Case{"lon=%zz&lat=1", "query"}, Case{"lon=1e&lat=1", "lon"}, Case{"lon=&lat=1", "lon"}}) {
    const HttpReply reply = get("/elevation/rainier?" + wrong.query);
    EXPECT_EQ(reply.status, 400) << wrong.query;
    if (wrong.parameter.empty()) continue;
    const Json problem = Json::parse(reply.body);
    EXPECT_EQ(problem["errors"][0]["parameter"], wrong.parameter) << wrong.query;
    EXPECT_EQ(problem["status"], 400);
  }
  EXPECT_EQ(get("/elevation/none?lon=1&lat=1").status, 404);
  EXPECT_EQ(get("/elevation/made-up?lon=1&lat=1").status, 404) << "a store has no DEM";
}

TEST_F(Api, TheViewerIsATableNotAFolder) {
  const std::string browser = "Accept: text/html,application/xhtml+xml,*/*;q=0.8\r\n";
  const HttpReply page = get("/", browser);
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.headers.at("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(get("/?dataset=rainier&more=1", browser).body, page.body) << "as its links are";
  for (const char* path : {"/viewer/", "/viewer/index.html"}) {
    EXPECT_EQ(get(path).status, 308) << "its files lie beside the root";
    EXPECT_EQ(get(std::string(path) + "?dataset=alps").headers.at("location"), "../?dataset=alps");
  }
  EXPECT_EQ(get("/viewer/a/b.js").body, "1");
  EXPECT_EQ(get("/", browser + "Accept-Encoding: gzip\r\n").headers.at("content-encoding"), "gzip");
  for (const char* path :
       {"/viewer/a", "/viewer/a/", "/viewer/.secret", "/viewer/link.txt", "/viewer/../index.html",
        "/viewer/a/../index.html", "/viewer/%2e%2e/index.html", "/viewer//index.html",
        "/viewer/INDEX.HTML", "/viewer/index.html/", "/viewer/./index.html", "/index.html",
        "/viewer/..\\index.html", "/viewer//etc/passwd", "/../../etc/passwd"})
    EXPECT_EQ(get(path).status, 404) << path;
  EXPECT_EQ(get("/viewer/..%2f..%2fetc%2fpasswd").status, 400);
  EXPECT_EQ(get("/viewer/index.html%00.js").status, 400);
  // What changes on the disk later does not change what is served.
  std::ofstream(dir_.file("new.js")) << "3";
  EXPECT_EQ(get("/viewer/new.js").status, 404);
}

TEST_F(Api, HealthAndMetrics) {
  EXPECT_EQ(get("/livez").body, "alive\n");
  EXPECT_EQ(get("/readyz").status, 200);
  EXPECT_EQ(get("/healthz").status, 200);
  get(kTile);
  get(kTile);
  get("/none");
  const HttpReply metrics = get("/metrics");
  EXPECT_EQ(metrics.headers.at("content-type"), "text/plain; version=0.0.4; charset=utf-8");
  for (const char* line :
       {"\ntind_tile_requests_total{result=\"hit\"} 1\n",
        "\ntind_tile_build_duration_seconds_count 1\n",
        "\ntind_http_requests_total{code=\"4xx\"} 1\n", "\ntind_datasets 1\n",
        "\ntind_cache_tiles 2\n", "# TYPE tind_http_request_duration_seconds histogram\n"})
    EXPECT_NE(metrics.body.find(line), std::string::npos) << line << metrics.body;
  // Every sample belongs to a metric that was announced, and is a number.
  const std::regex sample(
      R"(([a-z_]+?)(_bucket|_sum|_count)?(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [0-9.e+-]+)");
  std::istringstream lines(metrics.body);
  for (std::string line, announced; std::getline(lines, line);) {
    std::smatch parts;
    if (line.starts_with("# TYPE ")) announced = line.substr(7, line.find(' ', 7) - 7);
    if (line.starts_with('#')) continue;
    ASSERT_TRUE(std::regex_match(line, parts, sample)) << line;
    EXPECT_TRUE(line.starts_with(announced)) << line;
  }
  HttpClient client(port());
  ASSERT_EQ(client.get("/livez").status, 200);
  client.send("GET " + kTile);  // a request on its way keeps the connection through the stop
  while (running_->server().stats().connections == 0) std::this_thread::yield();
}

TEST_F(Api, NotReadyWhileStopping) {
  test::Gate gate(*made_up_);
  HttpClient busy(port()), probe(port());
  busy.send("GET " + kTile + " HTTP/1.1\r\nHost: a\r\n\r\n");
  while (pool_.admitted() == 0) std::this_thread::yield();
  probe.send("GET /readyz HTTP/1.1\r\n");
  while (running_->server().stats().connections < 2) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the half request is being read
  running_->server().stop();
  while (running_->server().ready()) std::this_thread::yield();
  probe.send("Host: a\r\n\r\n");
  EXPECT_EQ(probe.receive().status, 503);
  gate.open();
  EXPECT_EQ(busy.receive().status, 200);
  EXPECT_TRUE(running_->stop());
}

}  // namespace
}  // namespace tind::api
