// The whole daemon but its main: datasets, services and routes behind a real server.

// Under the sanitizers g++ 12 takes members of <regex>'s automaton for uninitialised (GCC 105562).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <regex>
#include <thread>

#include "proto/mesh_stream.h"
#include "proto/refine_delta.h"
#include "proto/tile_frames.h"
#include "proto/transition.h"
#include "server/api/app.h"
#include "server/api/extensions.h"
#include "server/api/methods.h"
#include "server/services/open_dataset.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/http_client.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/support.h"

namespace tind::api {
namespace {

using test::HttpClient;
using test::HttpReply;
using Json = nlohmann::json;

class Api : public ::testing::Test {
 protected:
  Api() {
    auto tiles = std::make_unique<test::MadeUpTiles>();
    made_up_ = tiles.get();
    catalog_.add("made-up", {}, std::move(tiles));
    const std::string page = dir_.file("index.html");
    std::ofstream(page) << "<html>" << std::string(1000, ' ') << "</html>";
    std::filesystem::create_directories(dir_.path() / "a");
    std::ofstream(dir_.file("a/b.js")) << "1";
    std::ofstream(dir_.file(".secret")) << "2";
    std::filesystem::create_symlink("/etc/passwd", dir_.path() / "link.txt");
    viewer_ = *http::StaticFiles::load(dir_.path().string());
  }
  ~Api() override {
    if (running_) running_->stop();
    pool_.stop();
  }

  void add_dem() {
    ASSERT_TRUE(
        services::open_dataset(catalog_, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  }
  std::uint16_t port() {
    if (!running_) {
      router_ = make_router(app_);
      running_.emplace(router_);
      app_.server = &running_->server();
    }
    return running_->port();
  }
  HttpReply get(const std::string& target, const std::string& fields = "") {
    return HttpClient(port()).get(target, fields);
  }

  HttpReply post(const std::string& target, const std::string& body) {
    HttpClient client(port());
    client.send("POST " + target + " HTTP/1.1\r\nHost: h\r\nContent-Length: " +
                std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive();
  }

  /// Each of `bodies` is a bad request.
  void expect_refused(const std::string& target, std::initializer_list<const char*> bodies) {
    for (const char* body : bodies) EXPECT_EQ(post(target, body).status, 400) << body;
  }

  test::TempDir dir_;
  test::MadeUpTiles* made_up_;
  services::Catalog catalog_;
  services::TileCache cache_{8 << 20};
  services::CpuPool pool_{2, 4};
  services::TileService tiles_{cache_, pool_};
  http::StaticFiles viewer_;
  services::RefineService refine_;
  services::TileStreams streams_{tiles_, cache_, pool_};
  services::TileTransitions transitions_{cache_, pool_};
  App app_{catalog_, tiles_, cache_, pool_, viewer_, nullptr, &refine_, &streams_, &transitions_};
  http::Router router_;
  std::optional<test::RunningServer> running_;
};

const std::string kTile = "/terrain/made-up/3/5/2.terrain";
const std::string kAll = "?extensions=octvertexnormals-metadata";

TEST_F(Api, ATransitionLeadsFromTheParentToTheTile) {
  const HttpReply reply = get("/transition/made-up/3/5/2");
  ASSERT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(reply.headers.at("content-type"), "application/vnd.tind.transition");
  std::string error;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(reply.body.data());
  const auto way = proto::decode_transition({bytes, reply.body.size()}, error);
  ASSERT_TRUE(way) << error;
  EXPECT_EQ(way->level, 3u);
  EXPECT_EQ(way->fine_vertices, 144u);
  EXPECT_EQ(get("/transition/made-up/3/5/2", "If-None-Match: " + reply.headers.at("etag") + "\r\n")
                .status,
            304);
  const int tiles_made = made_up_->built;
  EXPECT_EQ(get("/transition/made-up/3/5/2").body, reply.body);
  EXPECT_EQ(made_up_->built, tiles_made) << "from the cache";
  EXPECT_EQ(get("/transition/made-up/0/0/0").status, 404);  // no parent
  EXPECT_EQ(get("/transition/made-up/3/05/2").status, 404);
  EXPECT_EQ(get("/transition/nobody/3/5/2").status, 404);
}

proto::MeshStream stream_of(const std::string& bytes) {
  const auto stream = proto::decode_mesh_stream(
      {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  EXPECT_TRUE(stream) << stream.error();
  return stream.value_or(proto::MeshStream());
}

/// The address of a tile of the bundled DEM with some hundred vertices.
const std::string kStream = "/progressive/rainier/10/331/778";

TEST_F(Api, ATileComesAsAProgressiveMesh) {
  add_dem();
  std::string first;
  for (int round = 0; round < 2; ++round) {  // cold, then from the cache
    const HttpReply reply = get(kStream);
    ASSERT_EQ(reply.status, 200) << reply.body;
    EXPECT_EQ(reply.headers.at("content-type"), "application/vnd.tind.progressive-mesh");
    EXPECT_EQ(reply.headers.at("cache-control"), "public, max-age=3600");
    EXPECT_EQ(reply.headers.at("accept-ranges"), "bytes");
    EXPECT_FALSE(reply.headers.contains("vary"));
    const proto::MeshStream stream = stream_of(reply.body);
    EXPECT_EQ(stream.splits.size(), stream.total_splits);
    EXPECT_GT(stream.splits.size(), 100u);
    if (round == 0) first = reply.body;
    EXPECT_EQ(reply.body, first);
    const HttpReply same =
        get(kStream, "If-None-Match: " + reply.headers.at("etag") + "\r\nRange: bytes=0-9\r\n");
    EXPECT_EQ(same.status, 304);
    EXPECT_EQ(HttpClient(port()).head(kStream, "Range: bytes=0-9\r\n").status, 200);
  }
  EXPECT_EQ(get("/progressive/rainier/10/331/77").status, 404);
  EXPECT_EQ(get("/progressive/rainier/10/0331/778").status, 404);
  EXPECT_EQ(get("/progressive/nobody/10/331/778").status, 404);
  EXPECT_EQ(get("/progressive/made-up/3/5/2").status, 200);  // tiles without a DEM
  const Json datasets = Json::parse(get("/datasets").body);
  EXPECT_EQ(datasets["datasets"][1]["links"]["progressive"], "/progressive/rainier/{z}/{x}/{y}");
}

TEST_F(Api, AStreamComesInRanges) {
  add_dem();
  const HttpReply whole = get(kStream);
  ASSERT_EQ(whole.status, 200) << whole.body;
  const std::size_t size = whole.body.size();
  const std::string tag = whole.headers.at("etag"), all = std::to_string(size);
  struct Case {
    std::string fields;
    std::size_t first, count;
  };
  for (const Case& c : std::vector<Case>{{"Range: bytes=0-99", 0, 100},
                                         {"Range: BYTES=100-", 100, size - 100},
                                         {"Range: bytes=-7", size - 7, 7},
                                         {"Range: bytes=10-99999999999999999999999", 10, size - 10},
                                         {"If-Range: " + tag + "\r\nRange: bytes=5-5", 5, 1}}) {
    const HttpReply part = get(kStream, c.fields + "\r\n");
    EXPECT_EQ(part.status, 206) << c.fields;
    EXPECT_EQ(part.body, whole.body.substr(c.first, c.count)) << c.fields;
    EXPECT_EQ(part.headers.at("content-range"), "bytes " + std::to_string(c.first) + "-" +
                                                    std::to_string(c.first + c.count - 1) + "/" +
                                                    all);
    EXPECT_EQ(part.headers.at("etag"), tag);
  }
  // What is malformed, or about another version, gets the whole.
  for (const std::string fields :
       {"Range: bytes=9-5", "Range: bytes=x-", "Range: items=0-5", "Range: bytes=0-1,5-6",
        "Range: bytes=", "Range: bytes=--5", "Range: bytes=0-1\r\nRange: bytes=2-3",
        "If-Range: \"other\"\r\nRange: bytes=0-5"}) {
    const HttpReply reply = get(kStream, fields + "\r\n");
    EXPECT_EQ(reply.status, 200) << fields;
    EXPECT_EQ(reply.body.size(), size) << fields;
  }
  for (const std::string& range : {"bytes=" + all + "-", std::string("bytes=-0")}) {
    const HttpReply beyond = get(kStream, "Range: " + range + "\r\n");
    EXPECT_EQ(beyond.status, 416) << range;
    EXPECT_EQ(beyond.headers.at("content-range"), "bytes */" + all);
    EXPECT_EQ(beyond.headers.at("content-type"), "application/problem+json");
  }
  // Tiles themselves have no ranges, as before.
  EXPECT_EQ(get(kTile, "Range: bytes=0-9\r\n").status, 200);
}

TEST_F(Api, AStreamEndsWhereOneLikes) {
  add_dem();
  const std::string whole = get(kStream).body;
  const proto::MeshStream all = stream_of(whole);
  const double coarse = all.blocks[0].error_m;
  for (const double error : {coarse * 2, coarse * 0.3, all.fine_error_m * 1.5, 0.0}) {
    const HttpReply reply = get(kStream + "?max_error=" + std::to_string(error));
    ASSERT_EQ(reply.status, 200);
    EXPECT_EQ(whole.compare(0, reply.body.size(), reply.body), 0) << "a beginning of the whole";
    const proto::MeshStream part = stream_of(reply.body);
    const bool complete = part.splits.size() == all.total_splits;
    const double reached = complete ? part.fine_error_m : double(part.blocks.back().error_m);
    if (error >= all.fine_error_m) {
      EXPECT_LE(reached, error + 1e-6);
      // One byte less, and it could not be known.
      if (!complete) {
        EXPECT_LT(stream_of(reply.body.substr(0, reply.body.size() - 1)).blocks.size(),
                  part.blocks.size());
      }
    } else {
      EXPECT_TRUE(complete);
      EXPECT_EQ(reply.body, whole);
    }
  }
  for (const std::size_t triangles : {std::size_t(1), all.base_triangles.size() + 21}) {
    const HttpReply reply = get(kStream + "?triangles=" + std::to_string(triangles));
    ASSERT_EQ(reply.status, 200);
    EXPECT_EQ(whole.compare(0, reply.body.size(), reply.body), 0);
    const proto::MeshStream part = stream_of(reply.body);
    const std::size_t wanted = triangles == 1 ? 0 : 10;
    EXPECT_GE(part.splits.size(), wanted);
    EXPECT_LE(part.splits.size(), wanted + 3);
    EXPECT_FALSE(part.blocks.empty()) << "its error is told, too";
    // It is a resource of its own.
    EXPECT_EQ(get(kStream + "?triangles=" + std::to_string(triangles),
                  "If-None-Match: " + reply.headers.at("etag") + "\r\n")
                  .status,
              304);
    EXPECT_NE(reply.headers.at("etag"), get(kStream).headers.at("etag"));
  }
  for (const char* wrong :
       {"?triangles=0", "?triangles=1.5", "?triangles=x", "?max_error=-1", "?max_error=nan",
        "?max_error=", "?max_error=1&max_error=2", "?error=3", "?max_error=%zz"}) {
    const HttpReply reply = get(kStream + wrong);
    EXPECT_EQ(reply.status, 400) << wrong;
    EXPECT_EQ(Json::parse(reply.body)["errors"].size(), 1u) << wrong;
  }
}

TEST_F(Api, HoweverManyAskForAStreamItIsMadeOnce) {
  std::promise<void> gate;
  auto opened = gate.get_future().share();
  made_up_->before = [&](TileId) {
    opened.wait();
    return std::optional<Error>();
  };
  (void)port();
  std::vector<std::future<HttpReply>> asked;
  for (int i = 0; i < 12; ++i)  // more than the pool admits
    asked.push_back(
        std::async(std::launch::async, [&] { return get("/progressive/made-up/4/3/2"); }));
  while (made_up_->built == 0) std::this_thread::yield();
  gate.set_value();
  for (auto& reply : asked) EXPECT_EQ(reply.get().status, 200);
  EXPECT_EQ(made_up_->built, 1);
  made_up_->before = [](TileId) { return std::optional(Error{Errc::bad_data, "a secret path"}); };
  const HttpReply failed = get("/progressive/made-up/4/3/3");
  EXPECT_EQ(streams_.counters().built, 1u);
  EXPECT_NE(
      get("/metrics").body.find("\ntind_product_build_failures_total{product=\"progressive\"} 1\n"),
      std::string::npos);
  EXPECT_EQ(failed.status, 500);
  EXPECT_EQ(failed.body.find("secret"), std::string::npos);
}

TEST_F(Api, ManyTilesComeInOneResponse) {
  const HttpReply reply = post("/tiles/made-up", R"({"tiles":["3/5/2","9/0/0","0/1/0"]})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  std::string error;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(reply.body.data());
  const auto frames = proto::decode_frames({bytes, reply.body.size()}, error);
  ASSERT_TRUE(frames) << error;
  ASSERT_EQ(frames->size(), 3u);
  EXPECT_EQ((*frames)[0].status, 200u);
  EXPECT_EQ((*frames)[1].status, 404u);  // said, not dropped
  EXPECT_EQ((*frames)[2].level, 0u);
  const auto& first = (*frames)[0].bytes;
  EXPECT_EQ(std::string(first.begin(), first.end()), get("/terrain/made-up/3/5/2.terrain").body);

  expect_refused("/tiles/made-up",
                 {"", "{}", R"({"tiles":[]})", R"({"tiles":["3/5"]})", R"({"tiles":["3/05/2"]})",
                  R"({"tiles":[7]})", R"({"tile":[]})"});
}

TEST_F(Api, AFlightIsPlanned) {
  const HttpReply reply =
      post("/plan/made-up", R"({"position":{"lon":7,"lat":46,"height_m":3000},)"
                            R"("velocity":{"east":250},"horizon_s":300,"link_bits_per_s":1e7})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json plan = Json::parse(reply.body);
  ASSERT_GT(plan["tiles"].size(), 10u);
  EXPECT_EQ(plan["tiles"][0]["tile"], "0/0/0");
  EXPECT_GT(plan["lead_s"].get<double>(), 0);

  expect_refused("/plan/made-up",
                 {"", "[]", R"({"trajectory":[]})", R"({"trajectory":[{"lon":1}]})",
                  R"({"position":{"lon":7,"lat":46,"height_m":3},"horizon_s":1,"speed":2})",
                  R"({"position":{"lon":7,"lat":460,"height_m":3},"horizon_s":1})"});
}

TEST_F(Api, ATileHasAllItsHeaders) {
  for (int round = 0; round < 2; ++round) {  // cold, then from the cache
    const HttpReply reply = get(kTile + kAll);
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.headers.at("content-type"), "application/vnd.quantized-mesh");
    EXPECT_EQ(reply.headers.at("cache-control"), "public, max-age=3600");
    EXPECT_EQ(reply.headers.at("vary"), "Accept, Accept-Encoding");
    EXPECT_EQ(reply.headers.at("access-control-allow-origin"), "*");
    EXPECT_TRUE(std::regex_match(reply.headers.at("etag"), std::regex("\"[0-9a-f]{32}\"")));
    EXPECT_FALSE(reply.headers.contains("content-encoding"));
    const auto bytes = made_up_->tile({3, 5, 2}, {})->bytes;
    EXPECT_EQ(reply.body, std::string(bytes.begin(), bytes.end()));
  }
}

TEST_F(Api, EveryCombinationOfConditionsAndEncodings) {
  const std::string plain = get(kTile).headers.at("etag");
  const std::string packed = get(kTile, "Accept-Encoding: gzip\r\n").headers.at("etag");
  EXPECT_NE(plain, packed);
  struct Encoding {
    std::string field;
    bool gzip;
  };
  const Encoding encodings[] = {{"", false},
                                {"gzip", true},
                                {"gzip;q=0", false},
                                {"identity", false},
                                {"br, gzip;q=0.1", true},
                                {"*", true},
                                {"*;q=0", false},
                                {"identity;q=0, gzip", true}};
  const std::string tags[] = {
      "",  plain,  packed, "W/" + plain, "\"x\", " + plain + ", \"y\"", "\"x\", W/" + packed,
      "*", "\"x\""};
  int checked = 0;
  for (const Encoding& encoding : encodings)
    for (const std::string& tag : tags)
      for (const bool head : {false, true}) {
        std::string fields;
        if (!encoding.field.empty()) fields += "Accept-Encoding: " + encoding.field + "\r\n";
        if (!tag.empty()) fields += "If-None-Match: " + tag + "\r\n";
        const std::string& own = encoding.gzip ? packed : plain;
        const bool match = tag == "*" || tag.find(own) != std::string::npos;
        HttpClient client(port());
        const HttpReply reply = head ? client.head(kTile, fields) : client.get(kTile, fields);
        EXPECT_EQ(reply.status, match ? 304 : 200) << fields;
        EXPECT_EQ(reply.headers.at("etag"), own) << fields;
        EXPECT_EQ(reply.headers.at("vary"), "Accept, Accept-Encoding");
        EXPECT_EQ(reply.headers.at("cache-control"), "public, max-age=3600");
        EXPECT_EQ(reply.headers.contains("content-encoding"), encoding.gzip && !match) << fields;
        EXPECT_EQ(reply.headers.contains("content-length"), !match);
        EXPECT_EQ(reply.body.empty(), head || match);
        if (!head && !match) {
          EXPECT_EQ(reply.body.starts_with("\x1f\x8b"), encoding.gzip);
        }
        // The connection is still in step.
        EXPECT_EQ(client.get("/livez").body, "alive\n");
        ++checked;
      }
  EXPECT_EQ(checked, 128);
}

TEST_F(Api, ExtensionsInEveryDialect) {
  const auto size = [&](const std::string& query, const std::string& accept) {
    return get(kTile + query, accept.empty() ? "" : "Accept: " + accept + "\r\n").body.size();
  };
  const std::size_t bare = size("", ""), all = size(kAll, "");
  const std::size_t normals = size("?extensions=octvertexnormals", "");
  EXPECT_LT(bare, normals);
  EXPECT_LT(normals, all);
  const std::string mesh = "application/vnd.quantized-mesh";
  EXPECT_EQ(size("", mesh), bare);
  EXPECT_EQ(size("", mesh + ";extensions=octvertexnormals-watermask-metadata,application/"
                            "octet-stream;q=0.9,*/*;q=0.01"),
            all);
  EXPECT_EQ(size("", mesh + ",application/octet-stream;q=0.9;extensions=octvertexnormals-metadata"),
            all);
  EXPECT_EQ(size("", mesh + "; extensions=\"octvertexnormals\""), normals);
  EXPECT_EQ(size("?v=1.0.0&extensions=octvertexnormals", ""), normals);
  EXPECT_EQ(size("?extensions=unknown-octvertexnormals-x", ""), normals);
  EXPECT_EQ(size("?extensions=metadata", mesh + ";extensions=octvertexnormals"), all);
  EXPECT_EQ(size("?myextensions=metadata", mesh + ";xextensions=octvertexnormals"), bare);
  EXPECT_EQ(size("?extensions=", mesh + ";extensions="), bare);
  EXPECT_EQ(made_up_->built, 1) << "all from one build";
}

TEST_F(Api, AddressesOutsideAre404) {
  for (const char* address :
       {"5/0/0", "3/16/0", "3/0/8", "-1/0/0", "3/-1/0", "99/0/0", "999999999999/0/0", "3/1/1e0",
        "03/1/1", "3/+1/1", "3/0x1/1", "3/1.0/1", "3/ 1/1", "3/%31x/1", "a/b/c", "24/0/0"})
    EXPECT_EQ(get("/terrain/made-up/" + std::string(address) + ".terrain").status,
              std::string(address).find(' ') == std::string::npos ? 404 : 400)
        << address;
  EXPECT_EQ(get("/terrain/none/0/0/0.terrain").status, 404);
  EXPECT_EQ(get("/terrain/none/layer.json").status, 404);
  EXPECT_EQ(get("/terrain/..%2fetc/layer.json").status, 400);
  EXPECT_EQ(get("/terrain/%6dade-up/3/5/2.terrain").status, 200) << "escapes mean what they say";
  EXPECT_EQ(made_up_->built, 1) << "nothing else was built";
}

TEST_F(Api, SixtyFourClientsOneBuild) {
  std::promise<void> gate;
  auto opened = gate.get_future().share();
  made_up_->before = [&](TileId) {
    opened.wait();
    return std::optional<Error>();
  };
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 64; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET " + kTile + " HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (tiles_.counters().joined < 63) std::this_thread::yield();
  gate.set_value();
  std::string first;
  for (auto& client : clients) {
    const HttpReply reply = client->receive();
    EXPECT_EQ(reply.status, 200);
    if (first.empty()) first = reply.body;
    EXPECT_EQ(reply.body, first);
  }
  EXPECT_EQ(made_up_->built, 1);
}

TEST_F(Api, BuildFailuresReachAllAndAreNotCached) {
  std::promise<void> gate;
  auto opened = gate.get_future().share();
  made_up_->before = [&](TileId) {
    opened.wait();
    return std::optional<Error>({Errc::bad_data, "/secret/path.tif: block 3 is damaged"});
  };
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET " + kTile + " HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (tiles_.counters().joined < 7) std::this_thread::yield();
  gate.set_value();
  for (auto& client : clients) {
    const HttpReply reply = client->receive();
    EXPECT_EQ(reply.status, 500);
    EXPECT_EQ(reply.headers.at("content-type"), "application/problem+json");
    EXPECT_EQ(reply.headers.at("cache-control"), "no-store");
    EXPECT_EQ(reply.body.find("secret"), std::string::npos);
    EXPECT_EQ(client->get("/livez").status, 200);
  }
  EXPECT_EQ(cache_.tiles(), 0u);
  EXPECT_EQ(get("/terrain/made-up/layer.json").status, 200);
  made_up_->before = nullptr;
  EXPECT_EQ(get(kTile).status, 200);
}

TEST_F(Api, AFullQueueIsA503WithRetryAfter) {
  std::promise<void> gate;
  auto opened = gate.get_future().share();
  made_up_->before = [&](TileId) {
    opened.wait();
    return std::optional<Error>();
  };
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (std::size_t i = 0; i < pool_.capacity(); ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET /terrain/made-up/4/" + std::to_string(i) +
                         "/0.terrain HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (pool_.admitted() < pool_.capacity()) std::this_thread::yield();
  const HttpReply refused = get("/terrain/made-up/4/20/0.terrain");
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.headers.at("retry-after"), "1");
  EXPECT_EQ(get("/livez").status, 200);
  gate.set_value();
  for (auto& client : clients) EXPECT_EQ(client->receive().status, 200);
  EXPECT_EQ(get("/terrain/made-up/4/20/0.terrain").status, 200);
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
  EXPECT_EQ(list[1]["source"]["driver"], "GTiff");
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
  const HttpReply page = get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.headers.at("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(get("/viewer/").body, page.body);
  EXPECT_EQ(get("/viewer/index.html").body, page.body);
  EXPECT_EQ(get("/viewer/a/b.js").body, "1");
  EXPECT_EQ(get("/", "Accept-Encoding: gzip\r\n").headers.at("content-encoding"), "gzip");
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
  std::promise<void> gate;
  auto opened = gate.get_future().share();
  made_up_->before = [&](TileId) {
    opened.wait();
    return std::optional<Error>();
  };
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
  gate.set_value();
  EXPECT_EQ(busy.receive().status, 200);
  EXPECT_TRUE(running_->stop());
}

const std::string kCamera = R"("camera":{"lon":-121.8,"lat":46.7,"height_m":3500,"pitch_deg":-8,
  "heading_deg":10,"width_px":800,"height_px":600,"tolerance_px":2})";

TEST_F(Api, AViewIsSentOnceAndThenOnlyWhatChanges) {
  add_dem();
  const HttpReply first = post("/refine/rainier", "{" + kCamera + "}");
  ASSERT_EQ(first.status, 200) << first.body;
  EXPECT_EQ(first.headers.at("content-type"), "application/vnd.tind.refined-mesh");
  const auto whole = proto::decode_refine_delta(first.body);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->whole);
  EXPECT_GT(whole->triangles.size(), 1000u);

  std::string further = kCamera;
  further.replace(further.find("46.7"), 4, "46.702");
  const HttpReply next =
      post("/refine/rainier", "{\"view\":\"" + whole->view + "\"," + further + "}");
  const auto delta = proto::decode_refine_delta(next.body);
  ASSERT_TRUE(delta) << next.body;
  EXPECT_FALSE(delta->whole);
  EXPECT_LT(next.body.size(), first.body.size() / 5);

  // Applied, it is the mesh that the server would send whole for that camera.
  std::map<std::uint32_t, std::array<std::uint32_t, 3>> held;
  for (const auto& t : whole->triangles) held[t.id] = t.corners;
  for (const auto id : delta->removed_triangles) EXPECT_EQ(held.erase(id), 1u);
  for (const auto& t : delta->triangles) EXPECT_TRUE(held.emplace(t.id, t.corners).second);
  const auto again = proto::decode_refine_delta(post("/refine/rainier", "{" + further + "}").body);
  EXPECT_NEAR(double(held.size()), double(again->triangles.size()), 0.1 * double(held.size()));

  const HttpReply used =
      post("/refine/rainier", "{\"view\":\"" + whole->view + "\"," + kCamera + "}");
  EXPECT_EQ(used.status, 404) << "a token stands for one view";
  EXPECT_EQ(refine_.views(), 2u);
}

TEST_F(Api, ARegionIsOneMesh) {
  add_dem();
  const HttpReply reply = post(
      "/refine/rainier",
      R"({"region":{"route":[[-121.9,46.7],[-121.7,46.9]],"width_m":2000},"inside_m":5,"outside_m":100})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto mesh = proto::decode_refine_delta(reply.body);
  ASSERT_TRUE(mesh && mesh->whole && mesh->view.empty());
  EXPECT_GT(mesh->triangles.size(), 500u);
}

TEST_F(Api, WrongRefineRequestsSayWhatIsWrong) {
  add_dem();
  const std::string wrong[] = {
      "",
      "[]",
      "{}",
      "{\"camera\":1}",
      "{\"camera\":{\"lon\":1e99,\"lat\":0,\"height_m\":0}}",
      "{" + kCamera + ",\"x\":1}",
      "{" + kCamera + ",\"view\":7}",
      "{" + kCamera + ",\"window\":[1,2,3]}",
      "{" + kCamera + ",\"window\":[3,2,1,4]}",
      "{" + kCamera + ",\"window\":[1,2,3,4],\"view\":\"0123\"}",
      R"({"region":{"bbox":[1,2,3]},"inside_m":1,"outside_m":2})",
      R"({"region":{"bbox":[1,2,3,4]},"inside_m":3,"outside_m":2})",
      R"({"region":{"polygon":[[1,2],[3,"4"]]},"inside_m":1,"outside_m":2})",
      R"({"region":{"route":[[1,2],[3,4]]},"inside_m":1,"outside_m":2})"};
  for (const std::string& body : wrong) {
    const HttpReply reply = post("/refine/rainier", body);
    EXPECT_EQ(reply.status, 400) << body;
    EXPECT_EQ(reply.headers.at("content-type"), "application/problem+json");
  }
  EXPECT_EQ(post("/refine/nothing", "{" + kCamera + "}").status, 404);
  EXPECT_EQ(post("/refine/made-up", "{" + kCamera + "}").status, 404) << "a store has no DEM";
  EXPECT_EQ(post("/refine/rainier", "{\"view\":\"00\"," + kCamera + "}").status, 404);
}

TEST(RefineService, IsBoundedInPostsAndViews) {
  services::Catalog catalog;
  ASSERT_TRUE(
      services::open_dataset(catalog, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  const services::Dataset& dataset = *catalog.find("rainier");
  Camera camera;
  camera.position = {-121.8, 46.7};
  camera.height_m = 9000, camera.pitch_deg = -40, camera.tolerance_px = 50;
  services::RefineService small({.posts = 1000});
  const auto refused = small.view(dataset, camera, "", {}, {});
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_NE(refused.error().what.find("at most 1000"), std::string::npos);

  services::RefineService service({.views = 3});
  std::vector<std::string> tokens;
  for (int i = 0; i < 5; ++i) tokens.push_back(service.view(dataset, camera, "", {}, {})->view);
  EXPECT_EQ(service.views(), 3u);
  EXPECT_EQ(service.view(dataset, camera, tokens[0], {}, {}).error().code, Errc::not_found);
  EXPECT_TRUE(service.view(dataset, camera, tokens[4], {}, {}));
  services::RefineService forgets({.view_age = std::chrono::seconds(-1)});
  const auto first = forgets.view(dataset, camera, "", {}, {});
  EXPECT_EQ(forgets.view(dataset, camera, first->view, {}, {}).error().code, Errc::not_found);
}

TEST(RefineService, TakesWindowsOfWhatIsTooLarge) {
  services::Catalog catalog;
  ASSERT_TRUE(
      services::open_dataset(catalog, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  const services::Dataset& dataset = *catalog.find("rainier");
  services::RefineService service({.posts = 100'000});
  Camera camera;
  camera.position = {-121.8, 46.7};
  camera.height_m = 9000, camera.pitch_deg = -40, camera.tolerance_px = 20;
  const GeoRect south{-121.85, 46.65, -121.7, 46.75}, north{-121.85, 46.85, -121.7, 46.95};
  const auto refused = service.view(dataset, camera, "", {}, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("window"), std::string::npos) << refused.error().what;
  EXPECT_EQ(service.view(dataset, camera, "", dataset.tiles->dem()->info().bounds, {}).error().code,
            Errc::invalid_argument);
  EXPECT_EQ(service.view(dataset, camera, "", GeoRect{10, 10, 11, 11}, {}).error().code,
            Errc::invalid_argument);

  const auto reach = [](const proto::RefineDelta& mesh) {  // metres from its middle
    float most = 0;
    for (const auto& v : mesh.vertices) most = std::max(most, std::hypot(v.at[0], v.at[1]));
    return most;
  };
  const auto first = service.view(dataset, camera, "", south, {});
  ASSERT_TRUE(first) << first.error().what;
  EXPECT_NEAR(first->lat, 46.70, 0.03);
  EXPECT_GT(first->triangles.size(), 100u);
  EXPECT_LT(reach(*first), 15'000);
  const auto next = service.view(dataset, camera, first->view, {}, {});
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->whole);

  // A region brings its own window, of which every post is within the error that was asked for.
  const auto region = service.region(dataset, GeoRegion::box(north), {0, 50}, {}, {});
  ASSERT_TRUE(region) << region.error().what;
  EXPECT_NEAR(region->lat, 46.9, 0.03);
  const DemSource& dem = *dataset.tiles->dem();
  const auto in_window = service.region(dataset, GeoRegion::box(north), {0, 50}, north, {});
  ASSERT_TRUE(in_window) << in_window.error().what;
  for (const Geographic p : {Geographic{-121.8, 46.9}, {-121.75, 46.87}, {-121.72, 46.93}}) {
    // With no error at all inside, the post nearest to the place is a vertex.
    std::vector<Vec2> post(1);
    dem.to_post(std::vector{p}, post);
    post[0] = {std::round(post[0].x), std::round(post[0].y)};
    std::vector<Geographic> at(1);
    dem.to_geographic(post, at);
    const auto height = height_at(dem, at[0]);
    ASSERT_TRUE(height);
    const LocalFrame frame = LocalFrame::at({in_window->lon, in_window->lat});
    const Vec3 place = frame.from_ecef(wgs84::to_ecef(at[0], height->height_m));
    double nearest = HUGE_VAL;
    for (const auto& v : in_window->vertices)
      nearest =
          std::min(nearest, std::hypot(v.at[0] - place.x, v.at[1] - place.y, v.at[2] - place.z));
    EXPECT_LT(nearest, 0.1);
  }
  // Two windows are ready at a time: the first view's has gone, and the view with it.
  EXPECT_EQ(service.view(dataset, camera, next->view, {}, {}).error().code, Errc::not_found);
}

}  // namespace
}  // namespace tind::api
