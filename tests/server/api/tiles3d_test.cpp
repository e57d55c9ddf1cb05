// /3dtiles: tileset.json, subtrees and contents, and what is none.

#include <gtest/gtest.h>

#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

TEST_F(Api, TheWayFromTilesetJsonToATile) {
  add_dem();
  for (const std::string base :
       {"/3dtiles/made-up/", "/3dtiles/rainier/", "/3dtiles/rainier/meshopt/"}) {
    const HttpReply tileset = get(base + "tileset.json");
    ASSERT_EQ(tileset.status, 200) << tileset.body;
    EXPECT_EQ(tileset.headers.at("content-type"), "application/json");
    EXPECT_EQ(tileset.headers.at("cache-control"), "no-cache");
    const Json json = Json::parse(tileset.body);
    EXPECT_EQ(json["root"]["children"][0]["content"]["uri"], "west/{level}/{x}/{y}.glb");

    const HttpReply subtree = get(base + "west/0/0/0.subtree");
    ASSERT_EQ(subtree.status, 200);
    EXPECT_EQ(subtree.headers.at("content-type"), "application/octet-stream");
    EXPECT_EQ(subtree.body.substr(0, 4), "subt");

    const HttpReply tile = get(base + "east/0/0/0.glb");
    ASSERT_EQ(tile.status, 200);
    EXPECT_EQ(tile.headers.at("content-type"), "model/gltf-binary");
    EXPECT_EQ(tile.body.substr(0, 4), "glTF");
    EXPECT_EQ(
        get(base + "east/0/0/0.glb", "If-None-Match: " + tile.headers.at("etag") + "\r\n").status,
        304);
  }
}

TEST_F(Api, CompressedTilesetsAreSmallerAndKeptApart) {
  add_dem();
  const std::string tile = "west/9/165/389";  // the mountain
  const HttpReply plain = get("/3dtiles/rainier/" + tile + ".glb");
  const HttpReply packed = get("/3dtiles/rainier/meshopt/" + tile + ".glb");
  ASSERT_EQ(plain.status, 200) << plain.body;
  ASSERT_EQ(packed.status, 200) << packed.body;
  EXPECT_LT(packed.body.size(), plain.body.size() / 2);
  EXPECT_EQ(get("/3dtiles/rainier/" + tile + ".glb").body, plain.body);
}

TEST_F(Api, WhatIsNoPartOfATilesetIsNotFound) {
  add_dem();
  for (const std::string path :
       {"/3dtiles/nothing/tileset.json", "/3dtiles/nothing/west/0/0/0.glb",
        "/3dtiles/rainier/north/0/0/0.glb", "/3dtiles/rainier/west/0/1/0.glb",
        "/3dtiles/rainier/west/00/0/0.glb", "/3dtiles/rainier/west/-1/0/0.subtree",
        "/3dtiles/rainier/west/99/0/0.glb", "/3dtiles/rainier/east/1/0/0.glb",
        "/3dtiles/rainier/west/1/0/1.subtree",  // there is that tile, but no subtree begins there
        "/3dtiles/rainier/west/0/0/0.terrain", "/3dtiles/rainier/draco/tileset.json",
        "/3dtiles/nothing/meshopt/tileset.json", "/3dtiles/rainier/meshopt/west/1/0/1.subtree"})
    EXPECT_EQ(get(path).status, 404) << path;
  EXPECT_EQ(get("/3dtiles/rainier/west/1/0/1.glb").status, 200);
}

TEST_F(Api, ASetWithoutRootsIsNoTileset) {
  services::DatasetSpec spec{"deep", {test::testdata("rainier.tif")}};
  TileSetOptions options;
  options.first_level = 9;
  ASSERT_TRUE(services::open_dataset(catalog_, spec, {}, options));
  const HttpReply reply = get("/3dtiles/deep/tileset.json");
  EXPECT_EQ(reply.status, 404);
  EXPECT_NE(reply.body.find("level 9"), std::string::npos) << reply.body;
}

TEST_F(Api, ATileThatCannotBeMadeFailsItsSubtreeAlone) {
  made_up_->before = [](TileId id) -> std::optional<Error> {
    if (id.level == 2) return Error{Errc::io, "the disk is gone"};
    return {};
  };
  EXPECT_EQ(get("/3dtiles/made-up/west/0/0/0.subtree").status, 503);
  EXPECT_EQ(get("/3dtiles/made-up/west/1/0/0.glb").status, 200);
  made_up_->before = {};
  EXPECT_EQ(get("/3dtiles/made-up/east/0/0/0.subtree").status, 200);
}

}  // namespace
}  // namespace tind::api
