#include "proto/tile/glb.h"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <nlohmann/json.hpp>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

using Json = nlohmann::json;

Glb square() {
  Glb glb;
  glb.origin = {4e6, -1.5, 7};
  glb.positions = {{0, 0, 0}, {1, 0, -2}, {1, 1, 3}, {0, 1, 0.5f}};
  glb.normals.assign(4, {0, 0, 1});
  glb.triangles = {{0, 1, 2}, {0, 2, 3}};
  return glb;
}

struct Parts {
  Json json;
  std::string_view numbers;
};

/// Reads by the specification's text; fails the test where a length does not fit.
Parts parts_of(const std::vector<std::uint8_t>& bytes) {
  ByteReader in(bytes);
  EXPECT_EQ(in.get_text(4), "glTF");
  EXPECT_EQ(in.get<std::uint32_t>(), 2u);
  EXPECT_EQ(in.get<std::uint32_t>(), bytes.size());
  const auto size = in.get<std::uint32_t>();
  EXPECT_EQ(size % 4, 0u);
  EXPECT_EQ(in.get_text(4), "JSON");
  Parts parts{Json::parse(in.get_text(size)), {}};
  const auto numbers = in.get<std::uint32_t>();
  EXPECT_EQ(numbers % 4, 0u);
  EXPECT_EQ(in.get_text(4), std::string_view("BIN\0", 4));
  parts.numbers = in.get_text(numbers);
  EXPECT_TRUE(in.good());
  EXPECT_EQ(in.left(), 0u);
  return parts;
}

TEST(Glb, DescribesItsNumbersExactly) {
  const Glb glb = square();
  const std::vector<std::uint8_t> bytes = encode(glb);
  const Parts parts = parts_of(bytes);
  const Json& g = parts.json;
  const Json& primitive = g["meshes"][0]["primitives"][0];
  const auto view_of = [&](int accessor) {
    const Json& view = g["bufferViews"][int(g["accessors"][accessor]["bufferView"])];
    return ByteReader(parts.numbers.substr(view["byteOffset"], view["byteLength"]));
  };
  ByteReader positions = view_of(primitive["attributes"]["POSITION"]);
  for (const auto& p : glb.positions)
    for (const float x : p) EXPECT_EQ(positions.get<float>(), x);
  EXPECT_EQ(positions.left(), 0u);
  ByteReader indices = view_of(primitive["indices"]);
  for (const auto& t : glb.triangles)
    for (const std::uint32_t i : t) EXPECT_EQ(indices.get<std::uint16_t>(), i);
  EXPECT_EQ(indices.left(), 0u);
  const Json& box = g["accessors"][int(primitive["attributes"]["POSITION"])];
  EXPECT_EQ(box["min"], Json({0.0, 0.0, -2.0}));
  EXPECT_EQ(box["max"], Json({1.0, 1.0, 3.0}));
}

TEST(Glb, ItsNodeTurnsZUpToYUpAroundTheOrigin) {
  const Json node = parts_of(encode(square())).json["nodes"][0];
  const auto m = node["matrix"].get<std::vector<double>>();
  const auto turned = [&](double x, double y, double z, int row) {
    const auto r = std::size_t(row);
    return m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r];
  };
  // Position 2, at origin + (1, 1, 3): its height becomes y, its north becomes -z.
  EXPECT_EQ(turned(1, 1, 3, 0), 4e6 + 1);
  EXPECT_EQ(turned(1, 1, 3, 1), 7 + 3);
  EXPECT_EQ(turned(1, 1, 3, 2), -(-1.5 + 1));
}

TEST(Glb, MoreVerticesThanTwoBytesNameTakeFour) {
  Glb glb;
  for (int i = 0; i < 65536; ++i) glb.positions.push_back({float(i), float(i % 2), 0});
  glb.triangles = {{0, 2, 65535}};
  const Json g = parts_of(encode(glb)).json;
  const int indices = g["meshes"][0]["primitives"][0]["indices"];
  EXPECT_EQ(g["accessors"][indices]["componentType"], 5125);
  glb.positions.pop_back();
  glb.triangles = {{0, 2, 65534}};
  const Json h = parts_of(encode(glb)).json;
  EXPECT_EQ(h["accessors"][indices]["componentType"], 5123);
}

TEST(Glb, ExtrasStandAtTheNode) {
  Glb glb = square();
  glb.normals.clear();
  glb.extras = R"({"max_error_m":1.5})";
  const Json g = parts_of(encode(glb)).json;
  EXPECT_EQ(g["nodes"][0]["extras"]["max_error_m"], 1.5);
  EXPECT_FALSE(g["meshes"][0]["primitives"][0]["attributes"].contains("NORMAL"));
}

TEST(Glb, AMattSurfaceWithEdgesAndAWall) {
  Glb glb = square();
  glb.edges = Glb::Edges{{0, 3}, {1, 0}, {2, 1}, {3, 2}};
  glb.parts.push_back({{{0, 0, 0}, {0, 0, -9}, {1, 0, -2}}, {}, {{0, 1, 2}}, R"({"skirt":true})"});
  glb.matt = true;
  const std::vector<std::uint8_t> bytes = encode(glb);
  const Parts parts = parts_of(bytes);
  const Json& g = parts.json;
  const Json& primitives = g["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2u);
  EXPECT_EQ(g["extensionsUsed"], Json::array({"CESIUM_tile_edges"}));
  EXPECT_FALSE(g.contains("extensionsRequired"));
  const Json& edges = primitives[0]["extensions"]["CESIUM_tile_edges"];
  const auto list = [&](const char* side) {
    const Json& accessor = g["accessors"][edges[side].get<std::size_t>()];
    const Json& view = g["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    EXPECT_FALSE(view.contains("target")) << "neither vertices nor triangles";
    EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
    ByteReader in(parts.numbers.substr(view["byteOffset"], view["byteLength"]));
    std::vector<std::uint32_t> indices;
    while (in.left() > 0) indices.push_back(in.get<std::uint16_t>());
    EXPECT_EQ(accessor["count"], indices.size());
    return indices;
  };
  EXPECT_EQ(list("left"), glb.edges->left);
  EXPECT_EQ(list("bottom"), glb.edges->bottom);
  EXPECT_EQ(list("right"), glb.edges->right);
  EXPECT_EQ(list("top"), glb.edges->top);
  EXPECT_EQ(primitives[1]["extras"]["skirt"], true);
  const Json& wall = g["accessors"][primitives[1]["attributes"]["POSITION"].get<std::size_t>()];
  EXPECT_EQ(wall["min"], Json({0.0, 0.0, -9.0}));
  for (const Json& primitive : primitives) EXPECT_EQ(primitive["material"], 0);
  EXPECT_FALSE(g["materials"][0].contains("doubleSided"));
}

TEST(Glb, ColoursAreFloatsAndCompressedNumbersOf16Bits) {
  Glb glb = square();
  glb.positions = {{0, 0, 0}, {1, 0, 2}, {1, 1, 3}, {0, 1, 5}};
  glb.colours = {{0, 0.25f, 1}, {1, 1, 1}, {0.001f, 0, 0}, {0, 0, 0}};
  const auto of_colours = [](const Json& g) {
    return g["accessors"][int(g["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"])];
  };
  const std::vector<std::uint8_t> plain_bytes = encode(glb);
  const Json plain = of_colours(parts_of(plain_bytes).json);
  EXPECT_EQ(plain["componentType"], 5126);
  glb.meshopt = true;
  const std::vector<std::uint8_t> bytes = encode(glb);
  const Parts parts = parts_of(bytes);
  const Json packed = of_colours(parts.json);
  EXPECT_EQ(packed["componentType"], 5123);
  EXPECT_EQ(packed["normalized"], true);
  EXPECT_EQ(packed["count"], 4);
  const Json& view = parts.json["bufferViews"][int(packed["bufferView"])];
  const Json& where = view["extensions"]["EXT_meshopt_compression"];
  std::vector<std::array<std::uint16_t, 4>> colours(4);
  const std::string_view stored = parts.numbers.substr(where["byteOffset"], where["byteLength"]);
  ASSERT_EQ(meshopt_decodeVertexBuffer(colours.data(), 4, 8,
                                       reinterpret_cast<const unsigned char*>(stored.data()),
                                       stored.size()),
            0);
  EXPECT_EQ(colours[0], (std::array<std::uint16_t, 4>{0, 16384, 65535, 0}));
  EXPECT_EQ(colours[2], (std::array<std::uint16_t, 4>{66, 0, 0, 0}));
}

TEST(Glb, ClassesAreRowsOfATableThatVerticesName) {
  Glb glb = square();
  glb.classes = {{10, "Trees", {{0, 100, 0}}}, {80, "W\xc3\xa4sser", {{0, 0, 200}}}};
  glb.covers = {0, 1, kNoGlbClass, 1};
  glb.parts.push_back({{{0, 0, 0}, {0, 0, -9}, {1, 0, -2}}, {}, {{0, 1, 2}}, ""});
  glb.parts[0].covers = {1, 1, 0};
  const std::vector<std::uint8_t> bytes = encode(glb);
  const Parts parts = parts_of(bytes);
  const Json& g = parts.json;
  EXPECT_EQ(g["extensionsUsed"], Json::array({"EXT_mesh_features", "EXT_structural_metadata"}));
  const auto view = [&](const Json& number) {
    const Json& v = g["bufferViews"][number.get<std::size_t>()];
    EXPECT_EQ(v["byteOffset"].get<std::size_t>() % 4, 0u);
    return ByteReader(parts.numbers.substr(v["byteOffset"], v["byteLength"]));
  };
  const Json& primitives = g["meshes"][0]["primitives"];
  for (const std::size_t i : {0u, 1u}) {
    const Json& ids = primitives[i]["extensions"]["EXT_mesh_features"]["featureIds"][0];
    EXPECT_EQ(ids["attribute"], 0);
    EXPECT_EQ(ids["featureCount"], 2);
    EXPECT_EQ(ids["nullFeatureId"], kNoGlbClass);
    EXPECT_EQ(ids["propertyTable"], 0);
    const Json& accessor = g["accessors"][int(primitives[i]["attributes"]["_FEATURE_ID_0"])];
    EXPECT_EQ(accessor["componentType"], 5126);
    EXPECT_EQ(accessor["type"], "SCALAR");
    ByteReader in = view(accessor["bufferView"]);
    for (const std::uint16_t cover : i == 0 ? glb.covers : glb.parts[0].covers)
      EXPECT_EQ(in.get<float>(), float(cover));
    EXPECT_EQ(in.left(), 0u);
  }
  const Json& metadata = g["extensions"]["EXT_structural_metadata"];
  EXPECT_TRUE(metadata["schema"]["classes"].contains("landCover"));
  const Json& table = metadata["propertyTables"][0];
  EXPECT_EQ(table["class"], "landCover");
  EXPECT_EQ(table["count"], 2);
  ByteReader numbers = view(table["properties"]["class"]["values"]);
  EXPECT_EQ(numbers.get<std::uint16_t>(), 10);
  EXPECT_EQ(numbers.get<std::uint16_t>(), 80);
  EXPECT_EQ(numbers.left(), 0u);
  EXPECT_EQ(view(table["properties"]["name"]["values"]).get_text(12), "TreesW\xc3\xa4sser");
  ByteReader offsets = view(table["properties"]["name"]["stringOffsets"]);
  for (const std::uint32_t offset : {0u, 5u, 12u}) EXPECT_EQ(offsets.get<std::uint32_t>(), offset);
  ByteReader colours = view(table["properties"]["color"]["values"]);
  for (const int byte : {0, 100, 0, 0, 0, 200}) EXPECT_EQ(colours.get<std::uint8_t>(), byte);
}

TEST(Glb, AColumnThatNoClassFillsIsLeftOut) {
  Glb glb = square();
  glb.classes = {{1, "", {{1, 2, 3}}}, {2, "", {}}};
  glb.covers = {0, 0, 1, 1};
  const Json g = parts_of(encode(glb)).json;
  const Json& metadata = g["extensions"]["EXT_structural_metadata"];
  const Json& properties = metadata["propertyTables"][0]["properties"];
  EXPECT_TRUE(properties.contains("class"));
  EXPECT_FALSE(properties.contains("name"));
  EXPECT_FALSE(properties.contains("color"));
  EXPECT_EQ(metadata["schema"]["classes"]["landCover"]["properties"].size(), 3u);
}

TEST(Glb, AWaterMaskIsAPropertyTexture) {
  Glb glb = square();
  glb.water_mask_png = "not looked at";
  const std::vector<std::uint8_t> bytes = encode(glb);
  const Parts parts = parts_of(bytes);
  const Json& g = parts.json;
  EXPECT_EQ(g["extensionsUsed"], Json::array({"EXT_structural_metadata"}));
  const Json& metadata = g["extensions"]["EXT_structural_metadata"];
  EXPECT_EQ(metadata["schema"]["classes"]["surface"]["properties"]["water"]["semantic"],
            "WATERMASK");
  const Json& property = metadata["propertyTextures"][0]["properties"]["water"];
  const Json& image = g["images"][g["textures"][property["index"].get<int>()]["source"].get<int>()];
  EXPECT_EQ(image["mimeType"], "image/png");
  const Json& view = g["bufferViews"][image["bufferView"].get<int>()];
  EXPECT_EQ(parts.numbers.substr(view["byteOffset"], view["byteLength"]), glb.water_mask_png);
  EXPECT_FALSE(g.contains("materials"));
}

}  // namespace
}  // namespace tind::proto
