#include "proto/tile/glb_metadata.h"

#include <algorithm>
#include <cstdint>
#include <string>

namespace tind::proto {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMetadata = "EXT_structural_metadata";
constexpr const char* kMeshFeatures = "EXT_mesh_features";
constexpr const char* kCover = "landCover";

/// The image of a mask in the numbers, and what says that it is one.
void add_water_mask(Json& gltf, GlbBuffer& buffer, const std::string& png) {
  const int view = buffer.add_bytes(png);
  gltf["textures"] = Json::array({Json{{"source", 0}}});
  gltf["images"] = Json::array({Json{{"bufferView", view}, {"mimeType", "image/png"}}});
  Json& metadata = gltf["extensions"][kMetadata];
  metadata["schema"]["id"] = "terrain";
  metadata["schema"]["classes"]["surface"]["properties"]["water"] = {{"type", "SCALAR"},
                                                                     {"componentType", "UINT8"},
                                                                     {"normalized", true},
                                                                     {"semantic", "WATERMASK"}};
  Json texture;
  texture["class"] = "surface";
  texture["properties"]["water"] = {{"index", 0}, {"texCoord", 0}, {"channels", {0}}};
  metadata["propertyTextures"] = Json::array({texture});
}

/// The same in all files, whatever their classes have.
Json cover_schema() {
  Json properties;
  properties["class"] = {{"description", "Its number in the raster"},
                         {"type", "SCALAR"},
                         {"componentType", "UINT16"},
                         {"required", true}};
  properties["name"] = {{"type", "STRING"}, {"semantic", "NAME"}, {"noData", ""}};
  properties["color"] = {
      {"description", "sRGB, 0 to 255"}, {"type", "VEC3"}, {"componentType", "UINT8"}};
  return {{"name", "Land cover"}, {"properties", properties}};
}

Json names_of(const std::vector<GlbClass>& classes, GlbBuffer& buffer) {
  std::string all;
  std::vector<std::uint32_t> ends = {0};
  for (const GlbClass& c : classes) {
    all += c.name;
    ends.push_back(std::uint32_t(all.size()));
  }
  const int values = buffer.add_bytes(all);
  return {{"values", values}, {"stringOffsets", buffer.add_values(ends)}};
}

/// A column that not all rows can fill is left out, but names, which may be empty.
Json cover_table(const std::vector<GlbClass>& classes, GlbBuffer& buffer) {
  std::vector<std::uint16_t> numbers;
  std::vector<std::uint8_t> colours;
  for (const GlbClass& c : classes) {
    numbers.push_back(c.number);
    if (c.colour) colours.insert(colours.end(), c.colour->begin(), c.colour->end());
  }
  Json properties;
  properties["class"] = {{"values", buffer.add_values(numbers)}};
  if (std::ranges::any_of(classes, [](const GlbClass& c) { return !c.name.empty(); }))
    properties["name"] = names_of(classes, buffer);
  if (colours.size() == 3 * classes.size())
    properties["color"] = {{"values", buffer.add_values(colours)}};
  return {{"class", kCover}, {"count", classes.size()}, {"properties", properties}};
}

void add_classes(Json& gltf, Json& primitives, GlbBuffer& buffer,
                 const std::vector<GlbClass>& classes) {
  Json& metadata = gltf["extensions"][kMetadata];
  metadata["schema"]["id"] = "terrain";
  metadata["schema"]["classes"][kCover] = cover_schema();
  metadata["propertyTables"] = Json::array({cover_table(classes, buffer)});
  const Json features = {{"featureCount", classes.size()},
                         {"nullFeatureId", kNoGlbClass},
                         {"label", kCover},
                         {"attribute", 0},
                         {"propertyTable", 0}};
  for (Json& primitive : primitives)
    primitive["extensions"][kMeshFeatures]["featureIds"] = Json::array({features});
}

}  // namespace

std::vector<const char*> metadata_extensions(const Glb& glb) {
  std::vector<const char*> names;
  if (!glb.classes.empty()) names.push_back(kMeshFeatures);
  if (!glb.classes.empty() || !glb.water_mask_png.empty()) names.push_back(kMetadata);
  return names;
}

void add_metadata(Json& gltf, Json& primitives, GlbBuffer& buffer, const Glb& glb) {
  if (!glb.water_mask_png.empty()) {
    for (Json& primitive : primitives)
      primitive["extensions"][kMetadata]["propertyTextures"] = Json::array({0});
    add_water_mask(gltf, buffer, glb.water_mask_png);
  }
  if (!glb.classes.empty()) add_classes(gltf, primitives, buffer, glb.classes);
}

}  // namespace tind::proto
