// /progressive and /transition: what is made of tiles.

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "proto/stream/mesh_stream.h"
#include "proto/stream/transition.h"
#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

TEST_F(Api, ATransitionLeadsFromTheParentToTheTile) {
  const HttpReply reply = get("/transition/made-up/3/5/2");
  ASSERT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(reply.headers.at("content-type"), "application/vnd.tind.transition");
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(reply.body.data());
  const auto way = proto::decode_transition({bytes, reply.body.size()});
  ASSERT_TRUE(way) << way.error().what;
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
  EXPECT_TRUE(stream) << stream.error().what;
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
  EXPECT_EQ(get("/terrain/made-up/3/5/2.terrain", "Range: bytes=0-9\r\n").status, 200);
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
  test::Gate gate(*made_up_);
  (void)port();
  std::vector<std::future<HttpReply>> asked;
  for (int i = 0; i < 12; ++i)  // more than the pool admits
    asked.push_back(
        std::async(std::launch::async, [&] { return get("/progressive/made-up/4/3/2"); }));
  while (made_up_->built == 0) std::this_thread::yield();
  gate.open();
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

}  // namespace
}  // namespace tind::api
