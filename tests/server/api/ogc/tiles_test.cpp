// Tiles by OGC's addresses are tind's own, byte for byte.

#include "tests/server/api/ogc/ogc_fixture.h"

namespace tind::api {
namespace {

const std::string kTiles = "/collections/rainier/tiles/";

std::string path(int level, int row, int col) {
  return "/" + std::to_string(level) + "/" + std::to_string(row) + "/" + std::to_string(col);
}

TEST_F(Ogc, MeshTilesAreTheSameWithRowsFromTheNorth) {
  const Json tileset = json(kTiles + "WorldCRS84Quad");
  EXPECT_EQ(tileset["tileMatrixSetURI"],
            "http://www.opengis.net/def/tilematrixset/OGC/1.0/WorldCRS84Quad");
  int seen = 0;
  for (const Json& limits : tileset["tileMatrixSetLimits"]) {
    const int level = std::stoi(limits["tileMatrix"].get<std::string>());
    if (level > 8) break;
    for (int row = limits["minTileRow"]; row <= limits["maxTileRow"]; ++row)
      for (int col = limits["minTileCol"]; col <= limits["maxTileCol"]; ++col) {
        const HttpReply ours = get(kTiles + "WorldCRS84Quad" + path(level, row, col));
        const HttpReply tms =
            get("/terrain/rainier/" + std::to_string(level) + "/" + std::to_string(col) + "/" +
                std::to_string((1 << level) - 1 - row) + ".terrain");
        if (tms.status == 404) {
          EXPECT_EQ(ours.status, 204) << "within the limits, but empty";
          continue;
        }
        EXPECT_EQ(ours.status, 200);
        EXPECT_EQ(ours.body, tms.body);
        EXPECT_EQ(ours.headers.at("content-type"), tms.headers.at("content-type"));
        ++seen;
      }
  }
  EXPECT_GT(seen, 8);
}

TEST_F(Ogc, MapTilesAreTheSame) {
  const Json tileset = json(kTiles + "WebMercatorQuad");
  const Json limits = tileset["tileMatrixSetLimits"].back();
  const int level = std::stoi(limits["tileMatrix"].get<std::string>());
  const int row = limits["minTileRow"], col = limits["minTileCol"];
  const std::string xyz = path(level, col, row);
  struct Case {
    std::string ours, theirs;
  };
  for (const Case& c :
       {Case{"", "/shade/rainier" + xyz + ".png"},
        Case{"?style=slope", "/shade/rainier" + xyz + ".png?style=slope"},
        Case{"?style=mapbox", "/rgb/rainier" + xyz + ".png"},
        Case{"?style=terrarium&f=webp", "/rgb/rainier" + xyz + ".webp?encoding=terrarium"}}) {
    const HttpReply ours = get(kTiles + "WebMercatorQuad" + path(level, row, col) + c.ours);
    EXPECT_EQ(ours.status, 200) << c.ours;
    EXPECT_EQ(ours.body, get(c.theirs).body) << c.ours;
  }
  expect_wrong(kTiles + "WebMercatorQuad/0/0/0?style=pretty", "style");
}

TEST_F(Ogc, NoTileIsFoundOutsideItsMatrix) {
  for (const char* tile :
       {"WorldCRS84Quad/0/1/0", "WorldCRS84Quad/0/0/2", "WorldCRS84Quad/30/0/0",
        "WorldCRS84Quad/-1/0/0", "WorldCRS84Quad/a/b/c", "WorldCRS84Quad/00/0/0",
        "WebMercatorQuad/0/0/1", "WebMercatorQuad/0/1/0", "WebMercatorQuad/5/0/0",
        "WorldCRS84Quad/5/0/0", "GlobalGrid/0/0/0", "GlobalGrid"})
    EXPECT_EQ(get(kTiles + tile).status, 404) << tile;
  EXPECT_EQ(get("/collections/made-up/tiles/WebMercatorQuad").status, 404);
  EXPECT_EQ(json("/collections/made-up/tiles")["tilesets"].size(), 1u);
  EXPECT_EQ(json("/collections/rainier/tiles")["tilesets"].size(), 2u);
}

TEST_F(Ogc, MatricesAreThoseOfTheStandard) {
  // OGC 17-083r4, annex D.
  const Json world = json("/tileMatrixSets/WorldCRS84Quad"),
             web = json("/tileMatrixSets/WebMercatorQuad");
  EXPECT_NEAR(world["tileMatrices"][0]["scaleDenominator"].get<double>(), 279541132.0143589, 1e-5);
  EXPECT_EQ(world["tileMatrices"][0]["cellSize"], 0.703125);
  EXPECT_EQ(world["tileMatrices"][17]["matrixWidth"], 262144);
  EXPECT_EQ(world["tileMatrices"][17]["matrixHeight"], 131072);
  EXPECT_EQ(world["tileMatrices"][0]["pointOfOrigin"], Json::parse("[-180, 90]"));
  EXPECT_NEAR(web["tileMatrices"][0]["scaleDenominator"].get<double>(), 559082264.0287178, 1e-5);
  EXPECT_NEAR(web["tileMatrices"][0]["cellSize"].get<double>(), 156543.03392804097, 1e-9);
  EXPECT_NEAR(web["tileMatrices"][0]["pointOfOrigin"][1].get<double>(), 20037508.342789244, 1e-8);
  EXPECT_EQ(get("/tileMatrixSets/None").status, 404);
  EXPECT_EQ(json("/tileMatrixSets")["tileMatrixSets"].size(), 2u);
}

}  // namespace
}  // namespace tind::api
