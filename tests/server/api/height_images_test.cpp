// /rgb: heights as colours for web maps.

#include <gtest/gtest.h>

#include <set>

#include "tests/server/api/api_fixture.h"
#include "tests/support/made_up_source.h"

namespace tind::api {
namespace {

class HeightImagesApi : public Api {
 protected:
  HeightImagesApi() {
    catalog_.add("dem", dataset_of(Surface(std::make_shared<test::MadeUpSource>(
                            test::rough_terrain(60, 60, 2, 100), Geographic{7.01, 46.3}, .001))));
  }
};

TEST_F(HeightImagesApi, AreDescribedByTileJson) {
  const HttpReply reply = get("/rgb/dem/tiles.json?encoding=terrarium");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json json = Json::parse(reply.body);
  EXPECT_EQ(json["tilejson"], "3.0.0");
  EXPECT_EQ(json["encoding"], "terrarium");
  EXPECT_EQ(json["tileSize"], 512);
  EXPECT_NEAR(json["bounds"][0], 7.01, .001);
  const std::string tiles = json["tiles"][0];
  EXPECT_TRUE(tiles.starts_with("http://")) << tiles;
  EXPECT_NE(tiles.find("/rgb/dem/{z}/{x}/{y}.png?encoding=terrarium&v="), std::string::npos);
  const Json webp = Json::parse(get("/rgb/dem/tiles.json?format=webp").body);
  EXPECT_EQ(json["format"], "png");
  EXPECT_EQ(webp["format"], "webp");
  EXPECT_NE(std::string(webp["tiles"][0]).find("/{z}/{x}/{y}.webp?encoding=mapbox&v="),
            std::string::npos);
}

TEST_F(HeightImagesApi, AreMadeOnceAndKept) {
  const HttpReply first = get("/rgb/dem/1/1/0.png");
  ASSERT_EQ(first.status, 200) << first.body;
  EXPECT_EQ(first.headers.at("content-type"), "image/png");
  EXPECT_TRUE(first.body.starts_with("\x89PNG"));
  const HttpReply again = get("/rgb/dem/1/1/0.png?encoding=mapbox&v=x");
  EXPECT_EQ(again.body, first.body);
  const HttpReply other = get("/rgb/dem/1/1/0.png?encoding=terrarium");
  EXPECT_EQ(other.status, 200);
  EXPECT_NE(other.body, first.body);
  const HttpReply webp = get("/rgb/dem/1/1/0.webp");
  EXPECT_EQ(webp.status, 200);
  EXPECT_EQ(webp.headers.at("content-type"), "image/webp");
  EXPECT_EQ(webp.body.substr(8, 4), "WEBP");
  EXPECT_NE(get("/rgb/dem/1/1/0.webp?encoding=terrarium").body, webp.body);
}

TEST_F(HeightImagesApi, AreOfTheTilesWhereThatIsAsked) {
  // Tiles without their DEM.
  const Json json = Json::parse(get("/rgb/made-up/tiles.json?surface=mesh&format=webp").body);
  EXPECT_EQ(json["surface"], "mesh");
  EXPECT_EQ(json["maxzoom"], made_up_->layer().maxzoom);
  EXPECT_NE(std::string(json["tiles"][0])
                .find("/rgb/made-up/{z}/{x}/{y}.webp?encoding=mapbox&surface=mesh&v="),
            std::string::npos);
  // A DEM without tiles.
  EXPECT_EQ(get("/rgb/dem/tiles.json?surface=mesh").status, 404);
  EXPECT_EQ(get("/rgb/dem/1/1/0.png?surface=mesh").status, 404);
  EXPECT_EQ(get("/rgb/dem/1/1/0.png?surface=source").body, get("/rgb/dem/1/1/0.png").body);
  EXPECT_EQ(get("/rgb/made-up/22/0/0.png?surface=mesh").status, 404);
  EXPECT_EQ(get("/rgb/dem/1/1/0.png?surface=sea").status, 400);
}

TEST(AskedHeights, HaveANumberOfTheirOwn) {
  using services::AskedHeights;
  std::set<std::uint32_t> numbers;
  for (const auto code : {proto::HeightCode::mapbox, proto::HeightCode::terrarium})
    for (const auto format : {proto::ImageFormat::png, proto::ImageFormat::webp})
      for (const bool of_mesh : {false, true}) {
        const AskedHeights asked{code, format, of_mesh};
        EXPECT_TRUE(numbers.insert(asked.number()).second);
        const AskedHeights back = AskedHeights::of(asked.number());
        EXPECT_EQ(back.code, code);
        EXPECT_EQ(back.format, format);
        EXPECT_EQ(back.of_mesh, of_mesh);
      }
}

TEST_F(HeightImagesApi, RefuseWhatIsNotThere) {
  for (const char* target :
       {"/rgb/none/0/0/0.png", "/rgb/made-up/0/0/0.png", "/rgb/none/tiles.json",
        "/rgb/dem/1/0/0.png", "/rgb/dem/1/1/1.png", "/rgb/dem/22/0/0.png", "/rgb/dem/1/2/0.png",
        "/rgb/dem/01/1/0.png", "/rgb/dem/1/1/-0.png", "/rgb/dem/1/0/0.webp", "/rgb/dem/1/1/0.jpg"})
    EXPECT_EQ(get(target).status, 404) << target;
  for (const char* target : {"/rgb/dem/1/1/0.png?encoding=rgb", "/rgb/dem/1/1/0.png?size=256",
                             "/rgb/dem/tiles.json?encoding=x", "/rgb/dem/tiles.json?format=jpg",
                             "/rgb/dem/1/1/0.webp?format=png"})
    EXPECT_EQ(get(target).status, 400) << target;
}

}  // namespace
}  // namespace tind::api
