#include "proto/tile/layer_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/support/support.h"

namespace tind::proto {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

LayerJson two_levels() {
  LayerJson layer;
  layer.name = "crater";
  layer.attribution = "USGS";
  layer.version = "abc";
  layer.bounds = {-122.25, 42.8, -122, 43.0000001};
  layer.maxzoom = 1;
  layer.extensions = {"octvertexnormals", "metadata"};
  layer.available = {{{0, 0, 1, 0}}, {{0, 1, 0, 1}, {2, 0, 3, 1}}};
  return layer;
}

LayerJson must_decode(const std::string& text) {
  const auto layer = decode_layer_json(text);
  EXPECT_TRUE(layer.has_value()) << layer.error().what;
  return layer.value_or(LayerJson{});
}

std::string why_not(const std::string& text) {
  const auto layer = decode_layer_json(text);
  EXPECT_FALSE(layer) << text;
  return layer ? "" : layer.error().what;
}

TEST(LayerJson, EveryFieldThatSomeClientRequiresIsThere) {
  const auto json = nlohmann::json::parse(encode_layer_json(two_levels()));
  for (const char* key : {"format", "tiles", "version", "projection", "scheme", "available",
                          "minzoom", "maxzoom", "bounds", "extensions", "attribution", "name"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["format"], "quantized-mesh-1.0");
  EXPECT_EQ(json["scheme"], "tms");
  EXPECT_EQ(json["projection"], "EPSG:4326");
  EXPECT_EQ(json["available"][0][0],
            (nlohmann::json{{"startX", 0}, {"startY", 0}, {"endX", 1}, {"endY", 0}}));
  EXPECT_EQ(json["available"][1].size(), 2u);
  EXPECT_EQ(json["bounds"][3], 43.0000001);
}

TEST(LayerJson, WhatIsStatedOfTheHeightsIsReadAsItIsWritten) {
  LayerJson layer = two_levels();
  EXPECT_FALSE(nlohmann::json::parse(encode_layer_json(layer)).contains("accuracy"));
  layer.accuracy = {{"", "le90", 4}, {"town", "rmse", 0.3}, {"plane", "rmse", 0}};
  const std::string text = encode_layer_json(layer);
  EXPECT_EQ(nlohmann::json::parse(text)["accuracy"],
            nlohmann::json::parse(R"([{"kind":"le90","m":4},{"layer":"town","kind":"rmse","m":0.3},
                                {"layer":"plane","kind":"rmse","m":0}])"));
  EXPECT_EQ(must_decode(text).accuracy, layer.accuracy);
  for (const char* const bad : {"4", "[4]", R"([{"kind":"le90"}])", R"([{"m":-1}])",
                                R"([{"m":"4"}])", R"([{"m":4,"kind":7}])"})
    EXPECT_THAT(why_not(R"({"format":"quantized-mesh-1.0","tiles":["t"],"accuracy":)" +
                        std::string(bad) + "}"),
                HasSubstr("accuracy"));
}

TEST(LayerJson, MetadataAvailabilityIsWrittenWhereThereIsOne) {
  LayerJson layer = two_levels();
  EXPECT_FALSE(nlohmann::json::parse(encode_layer_json(layer)).contains("metadataAvailability"));
  layer.metadata_availability = 10;
  EXPECT_EQ(nlohmann::json::parse(encode_layer_json(layer))["metadataAvailability"], 10);
  EXPECT_EQ(must_decode(encode_layer_json(layer)).metadata_availability, 10);
}

TEST(LayerJson, SurvivesARoundTrip) {
  const std::string text = encode_layer_json(two_levels());
  EXPECT_EQ(encode_layer_json(must_decode(text)), text);
}

TEST(LayerJson, ANameThatIsNotUtf8IsWrittenAllTheSame) {
  LayerJson layer = two_levels();
  layer.name = "gl\xe4rnisch";
  EXPECT_THAT(must_decode(encode_layer_json(layer)).name, testing::StartsWith("gl"));
}

TEST(LayerJson, ContainsIsInclusiveAndPerLevel) {
  const LayerJson layer = two_levels();
  EXPECT_TRUE(layer.contains(0, 1, 0));
  EXPECT_TRUE(layer.contains(1, 0, 1));
  EXPECT_TRUE(layer.contains(1, 3, 1));
  EXPECT_FALSE(layer.contains(1, 1, 1));
  EXPECT_FALSE(layer.contains(1, 4, 1));
  EXPECT_FALSE(layer.contains(2, 0, 0));
  EXPECT_FALSE(layer.contains(-1, 0, 0));
}

TEST(LayerJson, MissingOptionalFieldsAreFine) {
  const LayerJson layer = must_decode(R"({"format":"quantized-mesh-1.0","tiles":["{z}/{x}/{y}.t"],
      "available":[[{"startX":0,"startY":0,"endX":1,"endY":0}],[]],"bvhlevels":6,"name":null})");
  EXPECT_EQ(layer.projection, "EPSG:4326");
  EXPECT_EQ(layer.maxzoom, 1);
  EXPECT_THAT(layer.tiles, ElementsAre("{z}/{x}/{y}.t"));
}

TEST(LayerJson, AsManyLevelsAsTilesCanHave) {
  const auto with_levels = [](int count) {
    std::string levels = "[]";
    for (int i = 1; i < count; ++i) levels += ",[]";
    return R"({"format":"quantized-mesh-1.0","tiles":["t"],"available":[)" + levels + "]}";
  };
  EXPECT_EQ(must_decode(with_levels(31)).available.size(), 31u);
  EXPECT_THAT(why_not(with_levels(32)), HasSubstr("at most 31 levels"));
}

TEST(LayerJson, SaysWhatIsWrong) {
  const auto with = [](const std::string& more) {
    return R"({"format":"quantized-mesh-1.0","tiles":["t"],)" + more + "}";
  };
  EXPECT_THAT(why_not(""), HasSubstr("not a JSON object"));
  EXPECT_THAT(why_not("[]"), HasSubstr("not a JSON object"));
  EXPECT_THAT(why_not("{}"), HasSubstr("no format"));
  EXPECT_THAT(why_not(R"({"format":"heightmap-1.0","tiles":["t"]})"), HasSubstr("heightmap-1.0"));
  EXPECT_THAT(why_not(R"({"format":"quantized-mesh-1.0"})"), HasSubstr("no tiles"));
  EXPECT_THAT(why_not(R"({"format":7,"tiles":["t"]})"), HasSubstr("format"));
  EXPECT_THAT(why_not(with(R"("maxzoom":-1)")), HasSubstr("maxzoom"));
  EXPECT_THAT(why_not(with(R"("maxzoom":1e9)")), HasSubstr("maxzoom"));
  EXPECT_THAT(why_not(with(R"("bounds":[1,2,3])")), HasSubstr("bounds"));
  EXPECT_THAT(why_not(with(R"("available":{})")), HasSubstr("available"));
  EXPECT_THAT(why_not(with(R"("available":[[],[{"startX":2,"startY":0,"endX":1,"endY":0}]])")),
              HasSubstr("level 1"));
  EXPECT_THAT(
      why_not(with(R"("available":[[{"startX":0,"startY":0,"endX":4294967296,"endY":0}]])")),
      HasSubstr("level 0"));
}

TEST(LayerJson, AnotherMakersLayerIsRead) {
  TIND_NEEDS_SHARED_DATA(path, "quantized-mesh/cesium-native/layer.json");
  std::ifstream in(path);
  const LayerJson layer =
      must_decode({std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()});
  EXPECT_EQ(layer.maxzoom, 19);
  EXPECT_EQ(layer.extensions.size(), 4u);
}

}  // namespace
}  // namespace tind::proto
