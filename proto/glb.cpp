// Header, a chunk of JSON that describes, a chunk of numbers: positions, normals, indices, each
// aligned to four bytes.

#include "proto/glb.h"

#include <algorithm>
#include <cassert>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2;  // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr int kFloat = 5126, kShort = 5123, kInt = 5125;        // component types
constexpr int kVertices = 34962, kIndices = 34963, kFaces = 4;  // targets; mode: triangles
constexpr int kNoTarget = 0;
constexpr const char* kTileEdges = "CESIUM_tile_edges";
constexpr const char* kMetadata = "EXT_structural_metadata";
constexpr std::size_t kLargest16Bit = 65535;  // vertices: the index 65535 restarts a primitive

/// Lays arrays out one behind the other and describes each as a view with one accessor.
class Layout {
 public:
  /// The number of a view that no accessor reads.
  int add(std::size_t begin, std::size_t end) {
    views_.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", end - begin}});
    return int(views_.size() - 1);
  }
  /// The accessor's number.
  int add(std::size_t begin, std::size_t end, int target, Json accessor) {
    views_.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", end - begin}});
    if (target != kNoTarget) views_.back()["target"] = target;
    accessor["bufferView"] = views_.size() - 1;
    accessors_.push_back(std::move(accessor));
    return int(accessors_.size() - 1);
  }
  void put_into(Json& gltf) {
    gltf["bufferViews"] = std::move(views_);
    gltf["accessors"] = std::move(accessors_);
  }

 private:
  Json views_ = Json::array(), accessors_ = Json::array();
};

void pad(std::vector<std::uint8_t>& bytes, std::uint8_t with) {
  while (bytes.size() % 4 != 0) bytes.push_back(with);
}

Json vectors(std::size_t count, const char* type = "VEC3") {
  return {{"componentType", kFloat}, {"count", count}, {"type", type}};
}

template <std::size_t N>
int add_vectors(Layout& layout, std::vector<std::uint8_t>& bytes,
                const std::vector<std::array<float, N>>& values, Json accessor) {
  const std::size_t begin = bytes.size();
  ByteWriter out(bytes);
  for (const auto& value : values)
    for (const float x : value) out.put(x);
  return layout.add(begin, bytes.size(), kVertices, std::move(accessor));
}

/// Readers want the box of the positions, exactly.
Json positions_accessor(const std::vector<std::array<float, 3>>& positions) {
  std::array<float, 3> low = positions.front(), high = low;
  for (const auto& p : positions)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  Json accessor = vectors(positions.size());
  accessor["min"] = low;
  accessor["max"] = high;
  return accessor;
}

/// Indices of `vertices` vertices. `put`: calls its argument with each.
template <class Put>
int add_indices(Layout& layout, std::vector<std::uint8_t>& bytes, std::size_t vertices, int target,
                const Put& put) {
  const bool small = vertices <= kLargest16Bit;
  const std::size_t begin = bytes.size();
  ByteWriter out(bytes);
  std::size_t count = 0;
  put([&](std::uint32_t index) {
    assert(index < vertices);
    small ? out.put(std::uint16_t(index)) : out.put(index);
    ++count;
  });
  const int number =
      layout.add(begin, bytes.size(), target,
                 {{"componentType", small ? kShort : kInt}, {"count", count}, {"type", "SCALAR"}});
  pad(bytes, 0);
  return number;
}

int add_triangles(Layout& layout, std::vector<std::uint8_t>& bytes, std::size_t vertices,
                  const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  return add_indices(layout, bytes, vertices, kIndices, [&](const auto& put) {
    for (const auto& triangle : triangles)
      for (const std::uint32_t index : triangle) put(index);
  });
}

Json tile_edges(Layout& layout, std::vector<std::uint8_t>& bytes, std::size_t vertices,
                const Glb::Edges& edges) {
  const auto add = [&](const std::vector<std::uint32_t>& side) {
    return add_indices(layout, bytes, vertices, kNoTarget, [&](const auto& put) {
      for (const std::uint32_t index : side) put(index);
    });
  };
  Json json;
  json["left"] = add(edges.left);
  json["bottom"] = add(edges.bottom);
  json["right"] = add(edges.right);
  json["top"] = add(edges.top);
  return json;
}

Json part_of(Layout& layout, std::vector<std::uint8_t>& bytes, const GlbPart& part) {
  assert(!part.positions.empty() && !part.triangles.empty());
  assert(part.normals.empty() || part.normals.size() == part.positions.size());
  Json attributes;
  attributes["POSITION"] =
      add_vectors(layout, bytes, part.positions, positions_accessor(part.positions));
  if (!part.normals.empty())
    attributes["NORMAL"] = add_vectors(layout, bytes, part.normals, vectors(part.normals.size()));
  if (!part.texcoords.empty())
    attributes["TEXCOORD_0"] =
        add_vectors(layout, bytes, part.texcoords, vectors(part.texcoords.size(), "VEC2"));
  const int indices = add_triangles(layout, bytes, part.positions.size(), part.triangles);
  Json primitive = {{"attributes", attributes}, {"indices", indices}, {"mode", kFaces}};
  if (!part.extras.empty()) primitive["extras"] = Json::parse(part.extras);
  return primitive;
}

/// x, y, z up -> x, z, -y: by columns, as glTF has matrices.
Json matrix(const Glb& glb) {
  const auto short_number = [](double v) {  // 1, not 1.0
    return v == std::trunc(v) && std::abs(v) < 1e15 ? Json(std::int64_t(v)) : Json(v);
  };
  Json m = Json::array();
  for (const auto& axis : glb.axes) {
    for (const double v : {axis[0], axis[2], -axis[1]}) m.push_back(short_number(v));
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

/// The image of a mask in the numbers, and what says that it is one.
void add_water_mask(Json& gltf, Layout& layout, std::vector<std::uint8_t>& numbers,
                    const std::string& png) {
  const std::size_t begin = numbers.size();
  ByteWriter(numbers).put_text(png);
  const int view = layout.add(begin, numbers.size());
  pad(numbers, 0);
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

/// Names of what a reader may leave out.
Json extensions_of(const Glb& glb) {
  Json names = Json::array();
  if (glb.edges) names.push_back(kTileEdges);
  if (!glb.water_mask_png.empty()) names.push_back(kMetadata);
  return names;
}

Json surface_of(Layout& layout, std::vector<std::uint8_t>& numbers, const Glb& glb) {
  assert(!glb.positions.empty() && !glb.triangles.empty());
  assert(glb.normals.empty() || glb.normals.size() == glb.positions.size());
  assert(glb.texture.empty() || glb.water_mask_png.empty());
  Json attributes;
  attributes["POSITION"] =
      add_vectors(layout, numbers, glb.positions, positions_accessor(glb.positions));
  if (!glb.normals.empty())
    attributes["NORMAL"] = add_vectors(layout, numbers, glb.normals, vectors(glb.normals.size()));
  if (!glb.colours.empty())
    attributes["COLOR_0"] = add_vectors(layout, numbers, glb.colours, vectors(glb.colours.size()));
  if (!glb.texcoords.empty())
    attributes["TEXCOORD_0"] =
        add_vectors(layout, numbers, glb.texcoords, vectors(glb.texcoords.size(), "VEC2"));
  const int indices = add_triangles(layout, numbers, glb.positions.size(), glb.triangles);
  Json primitive = {{"attributes", attributes}, {"indices", indices}, {"mode", kFaces}};
  if (glb.edges)
    primitive["extensions"][kTileEdges] =
        tile_edges(layout, numbers, glb.positions.size(), *glb.edges);
  return primitive;
}

}  // namespace

std::vector<std::uint8_t> encode(const Glb& glb) {
  std::vector<std::uint8_t> numbers;
  Layout layout;
  Json primitives = Json::array({surface_of(layout, numbers, glb)});
  for (const GlbPart& part : glb.parts) primitives.push_back(part_of(layout, numbers, part));

  Json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "tind"}};
  if (Json names = extensions_of(glb); !names.empty()) gltf["extensionsUsed"] = std::move(names);
  gltf["scene"] = 0;
  gltf["scenes"] = {{{"nodes", {0}}}};
  Json node = {{"mesh", 0}, {"matrix", matrix(glb)}};
  if (!glb.extras.empty()) node["extras"] = Json::parse(glb.extras);
  gltf["nodes"] = Json::array({std::move(node)});
  if (!glb.colours.empty() || !glb.texture.empty() || glb.matt) {
    for (Json& primitive : primitives) primitive["material"] = 0;
    gltf["materials"] = Json::array({material(glb)});
  }
  if (!glb.texture.empty()) {
    gltf["textures"] = Json::array({Json{{"source", 0}}});
    gltf["images"] = Json::array({Json{{"uri", uri_of(glb.texture)}}});
  }
  if (!glb.water_mask_png.empty()) {
    for (Json& primitive : primitives)
      primitive["extensions"][kMetadata]["propertyTextures"] = Json::array({0});
    add_water_mask(gltf, layout, numbers, glb.water_mask_png);
  }
  gltf["meshes"] = Json::array({Json{{"primitives", std::move(primitives)}}});
  gltf["buffers"] = {{{"byteLength", numbers.size()}}};
  layout.put_into(gltf);
  const std::string text = gltf.dump();
  std::vector<std::uint8_t> description(text.begin(), text.end());
  pad(description, ' ');

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
