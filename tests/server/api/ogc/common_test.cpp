// Landing page, conformance, collections: as JSON and as pages.

#include "server/api/crs_name.h"
#include "server/api/ogc/asked_crs.h"
#include "server/api/ogc/page.h"
#include "server/api/ogc/post_grid.h"
#include "tests/server/api/ogc/ogc_fixture.h"

namespace tind::api {
namespace {

TEST_F(Ogc, TheLandingPageLeadsEverywhere) {
  const Json landing = json("/");
  EXPECT_NE(href(landing, "service-desc", "application/vnd.oai.openapi+json;version=3.1"), "");
  const std::string conformance = "http://www.opengis.net/def/rel/ogc/1.0/conformance";
  EXPECT_EQ(href(landing, conformance, "application/json"), "http://test/conformance");
  EXPECT_EQ(href(landing, "data", "application/json"), "http://test/collections");
  EXPECT_EQ(href(landing, "alternate", "text/html"), "http://test/?f=html");
  EXPECT_FALSE(json("/conformance")["conformsTo"].empty());
}

TEST_F(Ogc, ABrowserGetsTheViewerAndMayHaveThePage) {
  const std::string browser = "Accept: text/html,*/*;q=0.8\r\n";
  EXPECT_EQ(get("/", browser).headers.at("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(get("/?dataset=rainier", browser).body, get("/", browser).body);
  EXPECT_EQ(get("/?dataset=rainier").status, 400) << "to programs it means nothing";
  EXPECT_NE(get("/?f=html").body.find("<h1>tind</h1>"), std::string::npos);
  EXPECT_EQ(get("/?f=json", browser).headers.at("content-type"), "application/json");
  EXPECT_EQ(get("/", "Accept: */*\r\n").headers.at("content-type"), "application/json");
  EXPECT_EQ(get("/").headers.at("vary"), "Accept, Host, X-Forwarded-Proto");
  EXPECT_EQ(get("/", browser).headers.at("vary"), "Accept, Accept-Encoding");
}

TEST_F(Ogc, DocumentsKnowWhereTheyWereAskedFor) {
  const std::string secure = "X-Forwarded-Proto: https\r\nAccept: application/json\r\n";
  EXPECT_NE(get("/collections", secure).body.find("https://test/collections/rainier"),
            std::string::npos);
  const HttpReply first = get("/collections/rainier");
  const HttpReply again =
      get("/collections/rainier", "If-None-Match: " + first.headers.at("etag") + "\r\n");
  EXPECT_EQ(again.status, 304);
}

TEST_F(Ogc, ACollectionSaysWhereItIsAndWhatItAnswers) {
  const Json all = json("/collections");
  ASSERT_EQ(all["collections"].size(), 2u);
  const Json one = json("/collections/rainier");
  const Json box = one["extent"]["spatial"]["bbox"];
  ASSERT_EQ(box.size(), 1u);
  EXPECT_NEAR(box[0][0].get<double>(), -122.0, 0.2);
  EXPECT_LT(box[0][1], box[0][3]);
  EXPECT_EQ(one["crs"][0], "http://www.opengis.net/def/crs/OGC/1.3/CRS84");
  EXPECT_EQ(one["storageCrs"], "http://www.opengis.net/def/crs/EPSG/0/4326");
  EXPECT_EQ(one["parameter_names"]["height"]["description"]["en"],
            "Height of the terrain, metres above egm96")
      << "as answers have it, not as tiles";
  EXPECT_EQ(one["parameter_names"]["height"]["unit"]["symbol"]["value"], "m");
  for (const char* query : {"position", "trajectory", "corridor", "area", "cube"})
    EXPECT_EQ(one["data_queries"][query]["link"]["variables"]["query_type"], query);
  EXPECT_EQ(href(one, "http://www.opengis.net/def/rel/ogc/1.0/coverage",
                 "image/tiff; application=geotiff"),
            "http://test/collections/rainier/coverage?f=tif");
  EXPECT_EQ(get("/collections/none").status, 404);
  EXPECT_EQ(get("/collections/").status, 404);
  EXPECT_EQ(href(json("/collections/made-up"), "http://www.opengis.net/def/rel/ogc/1.0/coverage",
                 "image/png"),
            "")
      << "tiles alone are no coverage";
}

TEST_F(Ogc, OtherParametersAreRefused) {
  for (const char* path :
       {"/", "/conformance", "/collections", "/collections/rainier", "/tileMatrixSets",
        "/tileMatrixSets/WebMercatorQuad", "/collections/rainier/tiles",
        "/collections/rainier/tiles/WorldCRS84Quad"}) {
    expect_wrong(std::string(path) + "?f=xml", "f");
    expect_wrong(std::string(path) + "?limit=3", "limit");
    expect_wrong(std::string(path) + "?F=json", "F");
    const HttpReply page = get(std::string(path) + "?f=html");
    EXPECT_EQ(page.headers.at("content-type"), "text/html; charset=utf-8");
    EXPECT_EQ(page.body.find("<script"), std::string::npos);
  }
}

TEST_F(Ogc, WhoReadsInABrowserGetsErrorsAsPages) {
  const std::string browser = "Accept: text/html,application/xhtml+xml,*/*;q=0.8\r\n";
  for (const auto& [path, status] :
       {std::pair("/collections/none", 404),
        {"/collections/", 404},
        {"/collections/rainier/nothing/at/all", 404},
        {"/collections?limit=3", 400},
        {"/collections/rainier/position?coords=POINT(1)", 400},
        {"/tileMatrixSets/none", 404},
        {"/processes/none", 404},
        {"/conformance?f=xml", 400},
        {"/collections/rainier/position?coords=POINT(1%202)&crs=EPSG:1", 400}}) {
    const HttpReply page = get(path, browser);
    EXPECT_EQ(page.status, status) << path;
    EXPECT_EQ(page.headers.at("content-type"), "text/html; charset=utf-8") << path;
    EXPECT_EQ(page.headers.at("cache-control"), "no-store") << path;
    const HttpReply problem = get(path);
    EXPECT_EQ(problem.status, status) << path;
    EXPECT_EQ(problem.headers.at("content-type"), "application/problem+json") << path;
    const std::string title = Json::parse(problem.body)["title"];
    EXPECT_NE(page.body.find("<h1>" + title + "</h1>"), std::string::npos) << page.body;
  }
  const std::string json = "application/problem+json";
  EXPECT_EQ(get("/collections/none?f=json", browser).headers.at("content-type"), json);
  EXPECT_EQ(get("/terrain/none/layer.json", browser).headers.at("content-type"), json);
  const HttpReply page = get("/collections/%3Cscript%3E?%3Cscript%3E=1", browser);
  EXPECT_EQ(page.status, 404);
  EXPECT_EQ(page.body.find("<script"), std::string::npos);
  HttpClient client(port());
  client.send("DELETE /collections HTTP/1.1\r\nHost: h\r\n" + browser + "\r\n");
  const HttpReply refused = client.receive();
  EXPECT_EQ(refused.status, 405);
  EXPECT_EQ(refused.headers.at("content-type"), json) << "no browser does that by itself";
}

TEST(OgcPage, WhatADocumentSaysIsNeverMarkup) {
  const std::string evil = "\"'><script>alert(1)</script>";
  const nlohmann::ordered_json document = {
      {"title", evil},
      {"description", evil},
      {evil, evil},
      {"list", {evil, evil}},
      {"table", {{{evil, evil}, {"b", 1}}, {{evil, evil}, {"b", 2}}}},
      {"cards", {{{"title", evil}, {"links", {{{"rel", "self"}, {"href", "http://h/" + evil}}}}}}},
      {"deep", {{"er", {{evil, {{"x", evil}}}}}}},
      {"links",
       {{{"href", "javascript:alert(1)"}, {"title", evil}, {"type", evil}},
        {{"href", "http://h/" + evil}, {"title", evil}},
        {{"href", "http://other/"}, {"title", "away"}}}}};
  const std::string page = ogc::page_of(document, {"/collections/" + evil, "http://h"});
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("href=\"javascript"), std::string::npos);
  EXPECT_EQ(page.find("href=\"http://other"), std::string::npos);
  std::size_t anchors = 0;  // none is broken out of
  for (std::size_t at = page.find("<a href=\""); at != page.npos;
       at = page.find("<a href=\"", at + 1)) {
    const std::size_t end = page.find('"', at + 9);
    EXPECT_EQ(page[end + 1], '>');
    ++anchors;
  }
  EXPECT_GE(anchors, 3u);
}

TEST(AskedCrs, TheWholeEarthInWebMercatorIsSquare) {
  DatasetFacts facts;
  facts.box = {-180, -90, 180, 90};
  const auto crs = ogc::AskedCrs::make("EPSG:3857", facts);
  ASSERT_TRUE(crs) << crs.error().what;
  const auto box = ogc::box_of(*crs, facts);
  ASSERT_TRUE(box) << box.error().what;
  EXPECT_NEAR(box->north, 20037508.342789, 1e-3);
  EXPECT_NEAR(box->south, -20037508.342789, 1e-3);
}

ogc::AskedCrs asked(const char* name, const DatasetFacts& facts) {
  auto crs = ogc::AskedCrs::make(name, facts);
  EXPECT_TRUE(crs) << name;
  return std::move(*crs);
}

TEST(AskedCrs, BoxesGoOnAcrossTheAntimeridian) {
  DatasetFacts facts;
  facts.box = {179.6, -16.9, 180.4, -16.2};
  const std::vector<const char*> names = {"CRS84",     "EPSG:4326", "EPSG:4258",
                                          "EPSG:3857", "EPSG:3832", "EPSG:32760"};
  const ogc::AskedCrs degrees = asked("CRS84", facts);
  for (const char* from : names) {
    const ogc::AskedCrs crs = asked(from, facts);
    const auto own = ogc::box_of(crs, facts);
    ASSERT_TRUE(own) << from;
    for (const char* to : names) {
      const auto there = ogc::box_in(*own, crs, asked(to, facts));
      ASSERT_TRUE(there) << from << " " << to;
      const auto back = ogc::box_in(*there, asked(to, facts), degrees);
      ASSERT_TRUE(back) << from << " " << to;
      // A box around a box in another projection is wider, but not the globe.
      EXPECT_NEAR(back->west, 179.6, .05) << from << " " << to;
      EXPECT_NEAR(back->east, 180.4, .05) << from << " " << to;
      EXPECT_NEAR(back->south, -16.9, .05) << from << " " << to;
    }
  }
  EXPECT_EQ(asked("EPSG:4258", facts).box({-16.5, 179.9, -16.4, -179.9})->east, 180.1);
  EXPECT_FALSE(asked("EPSG:4258", facts).box({-96.5, 179.9, -16.4, -179.9}));
}

TEST(AskedCrs, ABoxAroundAPoleHoldsIt) {
  DatasetFacts facts;
  facts.box = {-180, 88, 180, 90};
  for (const auto& [name, sign] : {std::pair{"EPSG:3413", 1}, std::pair{"EPSG:3031", -1}}) {
    const ogc::AskedCrs polar = asked(name, facts), degrees = asked("CRS84", facts);
    const auto whole = ogc::box_in({-50000, -50000, 50000, 50000}, polar, degrees);
    ASSERT_TRUE(whole) << name;
    EXPECT_EQ(whole->west, -180);
    EXPECT_EQ(whole->east, 180);
    EXPECT_EQ(sign > 0 ? whole->north : whole->south, 90 * sign);
    EXPECT_NEAR(sign > 0 ? whole->south : whole->north, 89.36 * sign, .02);
    const auto beside = ogc::box_in({10000, -50000, 50000, 50000}, polar, degrees);
    ASSERT_TRUE(beside) << name;
    EXPECT_LT(beside->width(), 180);
    EXPECT_LT(std::abs(sign > 0 ? beside->north : beside->south), 90);
  }
}

TEST(AskedCrs, PostsAreInsideOfTheEarth) {
  DatasetFacts facts;
  facts.box = {-180, 80, 180, 90};
  const ogc::AskedCrs degrees = asked("CRS84", facts);
  const ogc::CrsBox box{-180, 80, 180, 90};
  const ogc::CrsBox posts = ogc::PostGrid(Vec2{5000, 5000}).around(degrees, box);
  EXPECT_TRUE(degrees.is_on_globe(posts));
  EXPECT_EQ(posts.width(), 360);
  EXPECT_EQ(posts.north, 90);
  EXPECT_LT(posts.south, 80);
}

TEST(CrsName, EveryFormOfOne) {
  for (const char* text :
       {"EPSG:2056", "epsg:2056", "[EPSG:2056]", "http://www.opengis.net/def/crs/EPSG/0/2056",
        "https://www.opengis.net/def/crs/EPSG/9.9.1/2056", "urn:ogc:def:crs:EPSG::2056",
        "urn:ogc:def:crs:EPSG:8.2:2056"}) {
    ASSERT_TRUE(crs_named(text)) << text;
    EXPECT_EQ(crs_uri(*crs_named(text)), "http://www.opengis.net/def/crs/EPSG/0/2056");
  }
  for (const char* text : {"CRS84", "OGC:CRS84", "http://www.opengis.net/def/crs/OGC/1.3/CRS84",
                           "urn:ogc:def:crs:OGC:1.3:CRS84"})
    EXPECT_EQ(crs_named(text), "CRS84") << text;
  for (const char* text : {"", "2056", "EPSG:", "EPSG:x", "EPSG:12345678", "/etc/passwd",
                           "http://www.opengis.net/def/crs/EPSG/0/", "PROJCRS[]", "OGC:CRS83",
                           "http://elsewhere/def/crs/EPSG/0/2056", "+proj=utm"})
    EXPECT_FALSE(crs_named(text)) << text;
}

}  // namespace
}  // namespace tind::api
