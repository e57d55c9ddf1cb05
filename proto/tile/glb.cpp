// Header, a chunk of JSON that describes, a chunk of numbers (glb_buffer.h).

#include "proto/tile/glb.h"

#include <cassert>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "proto/tile/glb_buffer.h"
#include "proto/tile/glb_metadata.h"
#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2;  // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr int kFaces = 4;  // mode: triangles
constexpr const char* kTileEdges = "CESIUM_tile_edges";
constexpr const char* kFeatures = "_FEATURE_ID_0";
/// What CesiumJS's terrain divides compressed positions by, whatever the accessor says.
constexpr double kLargestPosition = 65535;

void pad(std::vector<std::uint8_t>& bytes, std::uint8_t with) {
  while (bytes.size() % 4 != 0) bytes.push_back(with);
}

Json tile_edges(GlbBuffer& buffer, std::size_t vertices, const Glb::Edges& edges) {
  Json json;
  json["left"] = buffer.add_indices(edges.left, vertices);
  json["bottom"] = buffer.add_indices(edges.bottom, vertices);
  json["right"] = buffer.add_indices(edges.right, vertices);
  json["top"] = buffer.add_indices(edges.top, vertices);
  return json;
}

Json part_of(GlbBuffer& buffer, const GlbPart& part) {
  assert(!part.positions.empty() && !part.triangles.empty());
  assert(part.normals.empty() || part.normals.size() == part.positions.size());
  Json attributes;
  attributes["POSITION"] = buffer.add_positions(part.positions);
  if (!part.normals.empty()) attributes["NORMAL"] = buffer.add_normals(part.normals);
  if (!part.colours.empty()) attributes["COLOR_0"] = buffer.add_colours(part.colours);
  if (!part.texcoords.empty()) attributes["TEXCOORD_0"] = buffer.add_texcoords(part.texcoords);
  if (!part.covers.empty()) attributes[kFeatures] = buffer.add_features(part.covers);
  const int indices = buffer.add_triangles(part.triangles, part.positions.size());
  Json primitive = {{"attributes", attributes}, {"indices", indices}, {"mode", kFaces}};
  if (!part.extras.empty()) primitive["extras"] = Json::parse(part.extras);
  return primitive;
}

/// x, y, z up -> x, z, -y: by columns, as glTF has matrices. `scale`: of what it is applied to.
Json matrix(const Glb& glb, double scale = 1) {
  const auto short_number = [](double v) {  // 1, not 1.0
    return v == std::trunc(v) && std::abs(v) < 1e15 ? Json(std::int64_t(v)) : Json(v);
  };
  Json m = Json::array();
  for (const auto& axis : glb.axes) {
    for (const double v : {axis[0], axis[2], -axis[1]}) m.push_back(short_number(v * scale));
    m.push_back(0);
  }
  for (const double v : {glb.origin[0], glb.origin[2], -glb.origin[1]}) m.push_back(v);
  m.push_back(1);
  return m;
}

/// A surface that shows its colours or its image as they are, from both sides unless it is matt.
Json material(const Glb& glb) {
  Json surface = {{"metallicFactor", 0}, {"roughnessFactor", 1}};
  if (!glb.texture.empty()) surface["baseColorTexture"] = {{"index", 0}};
  Json json = {{"pbrMetallicRoughness", surface}};
  if (!glb.matt) json["doubleSided"] = true;
  return json;
}

/// A relative URI of a file's name (RFC 3986).
std::string uri_of(const std::string& name) {
  std::string out;
  for (const unsigned char c : name) {
    if (std::isalnum(c) || c == '-' || c == '.' || c == '_' || c == '~' || c == '/') {
      out += char(c);
      continue;
    }
    constexpr char kHex[] = "0123456789ABCDEF";
    out += '%';
    out += kHex[c >> 4];
    out += kHex[c & 15];
  }
  return out;
}

void put_chunk(ByteWriter<>& out, std::uint32_t type, const std::vector<std::uint8_t>& bytes) {
  out.put(std::uint32_t(bytes.size()));
  out.put(type);
  out.put_bytes(bytes.data(), bytes.size());
}

/// Names of all extensions, first those that a reader may leave out.
Json extensions_of(const Glb& glb, const Json& required) {
  Json names = Json::array();
  if (glb.edges) names.push_back(kTileEdges);
  for (const char* name : metadata_extensions(glb)) names.push_back(name);
  for (const Json& name : required) names.push_back(name);
  return names;
}

Json surface_of(GlbBuffer& buffer, const Glb& glb) {
  assert(!glb.positions.empty() && !glb.triangles.empty());
  assert(glb.normals.empty() || glb.normals.size() == glb.positions.size());
  assert(glb.texture.empty() || glb.water_mask_png.empty());
  assert(glb.covers.size() == (glb.classes.empty() ? 0 : glb.positions.size()));
  Json attributes;
  attributes["POSITION"] = buffer.add_positions(glb.positions);
  if (!glb.normals.empty()) attributes["NORMAL"] = buffer.add_normals(glb.normals);
  if (!glb.colours.empty()) attributes["COLOR_0"] = buffer.add_colours(glb.colours);
  if (!glb.texcoords.empty()) attributes["TEXCOORD_0"] = buffer.add_texcoords(glb.texcoords);
  if (!glb.covers.empty()) attributes[kFeatures] = buffer.add_features(glb.covers);
  const int indices = buffer.add_triangles(glb.triangles, glb.positions.size());
  Json primitive = {{"attributes", attributes}, {"indices", indices}, {"mode", kFaces}};
  if (glb.edges)
    primitive["extensions"][kTileEdges] = tile_edges(buffer, glb.positions.size(), *glb.edges);
  return primitive;
}

/// CesiumJS's terrain takes the matrix of the first node, whether or not it is one of the scene,
/// and compressed positions as fractions of their largest. As fractions they are not exact in
/// floats, as whole numbers they are: so it gets a node of its own, which nobody draws.
void add_scene(Json& gltf, const Glb& glb) {
  gltf["scene"] = 0;
  Json nodes = Json::array();
  if (glb.meshopt && glb.edges) nodes.push_back({{"matrix", matrix(glb, kLargestPosition)}});
  gltf["scenes"] = Json::array({Json{{"nodes", Json::array({nodes.size()})}}});
  Json node = {{"mesh", 0}, {"matrix", matrix(glb)}};
  if (!glb.extras.empty()) node["extras"] = Json::parse(glb.extras);
  nodes.push_back(std::move(node));
  gltf["nodes"] = std::move(nodes);
}

void add_materials(Json& gltf, Json& primitives, const Glb& glb) {
  if (!glb.colours.empty() || !glb.texture.empty() || glb.matt) {
    for (Json& primitive : primitives) primitive["material"] = 0;
    gltf["materials"] = Json::array({material(glb)});
  }
  if (!glb.texture.empty()) {
    gltf["textures"] = Json::array({Json{{"source", 0}}});
    gltf["images"] = Json::array({Json{{"uri", uri_of(glb.texture)}}});
  }
}

}  // namespace

std::vector<std::uint8_t> encode(const Glb& glb) {
  GlbBuffer buffer(glb.meshopt);
  Json primitives = Json::array({surface_of(buffer, glb)});
  for (const GlbPart& part : glb.parts) primitives.push_back(part_of(buffer, part));

  Json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "tind"}};
  const Json required = buffer.required_extensions();
  if (Json names = extensions_of(glb, required); !names.empty())
    gltf["extensionsUsed"] = std::move(names);
  if (!required.empty()) gltf["extensionsRequired"] = required;
  add_scene(gltf, glb);
  add_materials(gltf, primitives, glb);
  add_metadata(gltf, primitives, buffer, glb);
  gltf["meshes"] = Json::array({Json{{"primitives", std::move(primitives)}}});
  buffer.put_into(gltf);
  const std::string text = gltf.dump();
  std::vector<std::uint8_t> description(text.begin(), text.end());
  pad(description, ' ');

  const std::vector<std::uint8_t>& numbers = buffer.bytes();
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  out.put(kMagic);
  out.put(kVersion);
  out.put(std::uint32_t(12 + 8 + description.size() + 8 + numbers.size()));
  put_chunk(out, kJsonChunk, description);
  put_chunk(out, kBinaryChunk, numbers);
  return bytes;
}

}  // namespace tind::proto
