// /shade: hillshade, slope and aspect for web maps.

#include <gtest/gtest.h>

#include <set>

#include "server/services/tiles/height_images.h"
#include "tests/server/api/api_fixture.h"
#include "tests/support/made_up_source.h"

namespace tind::api {
namespace {

class ShadesApi : public Api {
 protected:
  ShadesApi() {
    catalog_.add("dem", dataset_of(Surface(std::make_shared<test::MadeUpSource>(
                            test::rough_terrain(60, 60, 2, 100), Geographic{7.01, 46.3}, .001))));
  }
};

TEST_F(ShadesApi, AreDescribedByTileJson) {
  const HttpReply reply = get("/shade/dem/tiles.json?azimuth=360&z_factor=1.5");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json json = Json::parse(reply.body);
  EXPECT_EQ(json["style"], "hillshade");
  EXPECT_FALSE(json.contains("encoding"));
  const std::string tiles = json["tiles"][0];
  EXPECT_NE(tiles.find("/shade/dem/{z}/{x}/{y}.png?style=hillshade&azimuth=0&altitude=45&"
                       "z_factor=1.5&v="),
            std::string::npos)
      << tiles;
  EXPECT_EQ(Json::parse(get("/shade/dem/tiles.json?style=slope").body)["style"], "slope");
  const std::string webp = Json::parse(get("/shade/dem/tiles.json?format=webp").body)["tiles"][0];
  EXPECT_NE(webp.find("/{z}/{x}/{y}.webp?style=hillshade"), std::string::npos) << webp;
}

TEST_F(ShadesApi, AreKeptByAllThatIsAskedOfThem) {
  const std::string plain = "/shade/dem/9/266/181.png";
  const HttpReply first = get(plain);
  ASSERT_EQ(first.status, 200) << first.body;
  EXPECT_EQ(first.headers.at("content-type"), "image/png");
  EXPECT_EQ(get(plain + "?style=hillshade&azimuth=315&altitude=45&z_factor=1").body, first.body);
  const std::string etag = first.headers.at("etag");
  EXPECT_EQ(get(plain, "If-None-Match: " + etag + "\r\n").status, 304);
  std::set<std::string> bodies = {first.body};
  for (const char* query : {"style=slope", "style=aspect", "azimuth=10", "altitude=46",
                            "z_factor=1.1", "azimuth=45&altitude=31"}) {
    const HttpReply reply = get(plain + "?" + query);
    ASSERT_EQ(reply.status, 200) << query << reply.body;
    EXPECT_TRUE(bodies.insert(reply.body).second) << query;
    EXPECT_EQ(get(plain + "?" + query).body, reply.body);
  }
  const HttpReply webp = get("/shade/dem/9/266/181.webp");
  EXPECT_EQ(webp.headers.at("content-type"), "image/webp");
  EXPECT_TRUE(bodies.insert(webp.body).second);
}

TEST(AskedShade, HasANumberOfItsOwn) {
  using services::AskedShade;
  std::set<std::uint32_t> numbers;
  for (const auto style : {ShadeStyle::hillshade, ShadeStyle::slope, ShadeStyle::aspect})
    for (const int azimuth : {0, 1, 359})
      for (const int altitude : {0, 1, 90})
        for (const int z : {0, 1, 2000, 2001}) {  // tenths, times two for the format
          const auto format = z % 2 == 1 ? proto::ImageFormat::webp : proto::ImageFormat::png;
          const AskedShade asked{style, azimuth, altitude, z / 2, format};
          EXPECT_TRUE(numbers.insert(asked.number()).second);
          const AskedShade back = AskedShade::of(asked.number());
          EXPECT_EQ(back.style, style);
          EXPECT_EQ(back.azimuth_deg, azimuth);
          EXPECT_EQ(back.altitude_deg, altitude);
          EXPECT_EQ(back.z_tenths, z / 2);
          EXPECT_EQ(back.format, format);
        }
}

TEST_F(ShadesApi, RefuseWhatIsNotThere) {
  for (const char* target :
       {"/shade/none/0/0/0.png", "/shade/made-up/0/0/0.png", "/shade/none/tiles.json",
        "/shade/dem/1/0/0.png", "/shade/dem/22/0/0.png", "/shade/dem/01/1/0.png"})
    EXPECT_EQ(get(target).status, 404) << target;
  for (const char* query :
       {"style=relief", "azimuth=361", "azimuth=1.5", "altitude=91", "altitude=-1", "z_factor=101",
        "z_factor=x", "style=slope&azimuth=3", "style=aspect&z_factor=2", "size=256"}) {
    EXPECT_EQ(get(std::string("/shade/dem/1/1/0.png?") + query).status, 400) << query;
    EXPECT_EQ(get(std::string("/shade/dem/tiles.json?") + query).status, 400) << query;
  }
}

}  // namespace
}  // namespace tind::api
