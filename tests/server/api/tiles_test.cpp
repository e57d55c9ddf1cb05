// /terrain and /tiles: headers, conditions, encodings, extensions, one build for many, failures.

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "proto/stream/tile_frames.h"
#include "server/api/extensions.h"
#include "terrain/geo/ellipsoid.h"
#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

const std::string kTile = "/terrain/made-up/3/5/2.terrain";
const std::string kAll = "?extensions=octvertexnormals-metadata";

TEST_F(Api, ManyTilesComeInOneResponse) {
  const HttpReply reply = post("/tiles/made-up", R"({"tiles":["3/5/2","9/0/0","0/1/0"]})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(reply.body.data());
  const auto frames = proto::decode_frames({bytes, reply.body.size()});
  ASSERT_TRUE(frames) << frames.error().what;
  ASSERT_EQ(frames->size(), 3u);
  EXPECT_EQ((*frames)[0].status, 200u);
  EXPECT_EQ((*frames)[1].status, 404u);  // said, not dropped
  EXPECT_EQ((*frames)[2].level, 0u);
  const auto& first = (*frames)[0].bytes;
  EXPECT_EQ(std::string(first.begin(), first.end()), get("/terrain/made-up/3/5/2.terrain").body);

  expect_refused("/tiles/made-up", {{"", "body"},
                                    {"{}", "tiles"},
                                    {R"({"tiles":[]})", "tiles"},
                                    {R"({"tiles":["3/5"]})", "tiles[0]"},
                                    {R"({"tiles":["3/5/2","3/05/2"]})", "tiles[1]"},
                                    {R"({"tiles":[7]})", "tiles[0]"},
                                    {R"({"tiles":["3/5/2"],"tile":[]})", "tile"}});
}

TEST_F(Api, PostsAreRefusedBeforeTheirBodies) {
  add_dem();
  for (const std::string path : {"/plan/", "/tiles/", "/refine/"}) {
    const auto begin = [&](const std::string& dataset, const std::string& type) {
      HttpClient client(port());
      client.send("POST " + path + dataset + " HTTP/1.1\r\nHost: h\r\nContent-Type: " + type +
                  "\r\nContent-Length: 60000\r\nExpect: 100-continue\r\n\r\n");
      return client.receive().status;
    };
    EXPECT_EQ(begin("rainier", "application/json"), 100) << path;
    EXPECT_EQ(begin("nothing", "application/json"), 404) << path;
    EXPECT_EQ(begin("rainier", "text/plain;charset=UTF-8"), 415) << path;
  }
}

TEST_F(Api, ATileCanBeHadInOtherFormats) {
  add_dem();
  for (const std::string path : {"/terrain/made-up/3/5/2.glb", "/terrain/rainier/0/0/0.glb"}) {
    std::string first;
    for (int round = 0; round < 2; ++round) {  // cold, then from the cache
      const HttpReply reply = get(path);
      ASSERT_EQ(reply.status, 200) << path << reply.body;
      EXPECT_EQ(reply.headers.at("content-type"), "model/gltf-binary");
      EXPECT_EQ(reply.body.substr(0, 4), "glTF");
      if (round == 0) first = reply.body;
      EXPECT_EQ(reply.body, first);
      EXPECT_EQ(get(path, "If-None-Match: " + reply.headers.at("etag") + "\r\n").status, 304);
    }
  }
  EXPECT_EQ(get("/terrain/rainier/9/0/0.glb").status, 404);
  EXPECT_EQ(get("/terrain/nothing/0/0/0.glb").status, 404);
  EXPECT_EQ(get("/terrain/rainier/0/0/0.exe").status, 404);
}

TEST_F(Api, ATileHasAllItsHeaders) {
  for (int round = 0; round < 2; ++round) {  // cold, then from the cache
    const HttpReply reply = get(kTile + kAll);
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.headers.at("content-type"), "application/vnd.quantized-mesh");
    EXPECT_EQ(reply.headers.at("cache-control"), "public, max-age=3600");
    EXPECT_EQ(reply.headers.at("vary"), "Accept, Accept-Encoding");
    EXPECT_EQ(reply.headers.at("access-control-allow-origin"), "*");
    const std::string etag = reply.headers.at("etag");
    EXPECT_EQ(etag.size(), 34u);
    EXPECT_EQ(etag.find_first_not_of("0123456789abcdef", 1), 33u) << etag;
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
  test::Gate gate(*made_up_);
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 64; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET " + kTile + " HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (tiles_.counters().joined < 63) std::this_thread::yield();
  gate.open();
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
  test::Gate gate(*made_up_, Error{Errc::bad_data, "/secret/path.tif: block 3 is damaged"});
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET " + kTile + " HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (tiles_.counters().joined < 7) std::this_thread::yield();
  gate.open();
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
  test::Gate gate(*made_up_);
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (std::size_t i = 0; i < pool_.capacity(services::Work::tile); ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET /terrain/made-up/4/" + std::to_string(i) +
                         "/0.terrain HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (pool_.admitted() < pool_.capacity(services::Work::tile)) std::this_thread::yield();
  const HttpReply refused = get("/terrain/made-up/4/20/0.terrain");
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.headers.at("retry-after"), "1");
  EXPECT_EQ(get("/livez").status, 200);
  gate.open();
  for (auto& client : clients) EXPECT_EQ(client->receive().status, 200);
  EXPECT_EQ(get("/terrain/made-up/4/20/0.terrain").status, 200);
}

}  // namespace
}  // namespace tind::api
