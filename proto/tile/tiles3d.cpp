// A subtree: a header of 24 bytes, JSON, then bits and columns of numbers. Every view begins at a
// multiple of eight.

#include "proto/tile/tiles3d.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x74627573, kVersion = 1;  // "subt"

constexpr const char* kClass = "tile";
struct Property {
  const char *name, *semantic, *type, *component;
  int array = 0;  // numbers; 0: one
};
constexpr std::array kProperties = {
    Property{"minHeight", "TILE_MINIMUM_HEIGHT", "SCALAR", "FLOAT32"},
    Property{"maxHeight", "TILE_MAXIMUM_HEIGHT", "SCALAR", "FLOAT32"},
    Property{"boundingSphere", "TILE_BOUNDING_SPHERE", "SCALAR", "FLOAT64", 4},
    Property{"horizonOcclusionPoint", "TILE_HORIZON_OCCLUSION_POINT", "VEC3", "FLOAT64"},
    Property{"geometricError", "TILE_GEOMETRIC_ERROR", "SCALAR", "FLOAT64"},
};

float rounded_down(double x) {
  const float f = float(x);
  return double(f) > x ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float rounded_up(double x) { return -rounded_down(-x); }

void pad(std::vector<std::uint8_t>& bytes, std::uint8_t with) {
  while (bytes.size() % 8 != 0) bytes.push_back(with);
}

/// The buffer of a subtree and the list of its views.
class Buffer {
 public:
  /// `fill` gets a writer; the number of the view.
  template <class Fill>
  std::size_t add(const Fill& fill) {
    const std::size_t begin = bytes_.size();
    ByteWriter out(bytes_);
    fill(out);
    views_.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes_.size() - begin}});
    pad(bytes_, 0);
    return views_.size() - 1;
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  const Json& views() const { return views_; }

 private:
  std::vector<std::uint8_t> bytes_;
  Json views_ = Json::array();
};

/// One bit each, the lowest of a byte first; a word for all where they are the same.
Json availability(Buffer& buffer, const std::vector<bool>& bits) {
  std::size_t count = 0;
  for (const bool bit : bits) count += bit;
  if (count == 0 || count == bits.size()) return {{"constant", count == 0 ? 0 : 1}};
  const std::size_t view = buffer.add([&](ByteWriter<>& out) {
    for (std::size_t i = 0; i < bits.size(); i += 8) {
      std::uint8_t byte = 0;
      for (std::size_t k = i; k < std::min(i + 8, bits.size()); ++k)
        byte = std::uint8_t(byte | (bits[k] ? 1 << (k - i) : 0));
      out.put(byte);
    }
  });
  return {{"bitstream", view}, {"availableCount", count}};
}

/// The columns of kProperties, for the tiles that there are.
Json property_table(Buffer& buffer, const std::vector<const Tile3d*>& rows) {
  const auto column = [&](const auto& put) {
    return Json{{"values", buffer.add([&](ByteWriter<>& out) {
                   for (const Tile3d* tile : rows) put(out, *tile);
                 })}};
  };
  Json properties;
  properties[kProperties[0].name] =
      column([](auto& out, const Tile3d& t) { out.put(rounded_down(t.min_height)); });
  properties[kProperties[1].name] =
      column([](auto& out, const Tile3d& t) { out.put(rounded_up(t.max_height)); });
  properties[kProperties[2].name] = column([](auto& out, const Tile3d& t) {
    for (const double x : t.sphere) out.put(x);
  });
  properties[kProperties[3].name] = column([](auto& out, const Tile3d& t) {
    for (const double x : t.horizon_occlusion) out.put(x);
  });
  properties[kProperties[4].name] =
      column([](auto& out, const Tile3d& t) { out.put(t.geometric_error); });
  return {{"class", kClass}, {"count", rows.size()}, {"properties", std::move(properties)}};
}

Json schema() {
  Json properties;
  for (const Property& p : kProperties) {
    Json& json = properties[p.name];
    json = {{"type", p.type}, {"componentType", p.component}};
    if (p.array > 0) json["array"] = true, json["count"] = p.array;
    json["semantic"] = p.semantic;
    json["required"] = true;
  }
  Json json;
  json["id"] = "terrain";
  json["classes"][kClass]["properties"] = std::move(properties);
  return json;
}

Json region(double west, double east, const Tileset3d& set) {
  constexpr double kHalf = std::numbers::pi / 2;
  Json json;
  json["region"] = {west, -kHalf, east, kHalf, set.min_height, set.max_height};
  return json;
}

Json hemisphere(const std::string& name, double west, double east, const Tileset3d& set) {
  const std::string at = name + "/{level}/{x}/{y}";
  Json json;
  json["boundingVolume"] = region(west, east, set);
  json["geometricError"] = set.geometric_error;
  json["refine"] = "REPLACE";
  json["content"]["uri"] = at + ".glb";
  json["implicitTiling"] = {{"subdivisionScheme", "QUADTREE"},
                            {"subtreeLevels", set.subtree_levels},
                            {"availableLevels", set.levels}};
  json["implicitTiling"]["subtrees"]["uri"] = at + ".subtree";
  return json;
}

}  // namespace

std::uint32_t morton(std::uint32_t x, std::uint32_t y) {
  std::uint32_t number = 0;
  for (int bit = 0; bit < 16; ++bit)
    number |= (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1);
  return number;
}

std::vector<std::uint8_t> encode(const Subtree& subtree) {
  std::vector<bool> there;
  std::vector<const Tile3d*> rows;
  for (const auto& tile : subtree.tiles) {
    there.push_back(tile.has_value());
    if (tile) rows.push_back(&*tile);
  }
  assert(!rows.empty());
  Buffer buffer;
  Json json;
  const Json tiles = availability(buffer, there);
  const Json children = availability(buffer, subtree.children);
  const Json table = property_table(buffer, rows);
  json["buffers"] = Json::array({Json{{"byteLength", buffer.bytes().size()}}});
  json["bufferViews"] = buffer.views();
  json["propertyTables"] = Json::array({table});
  json["tileMetadata"] = 0;
  json["tileAvailability"] = tiles;
  json["contentAvailability"] = Json::array({tiles});
  json["childSubtreeAvailability"] = children;

  const std::string text = json.dump();
  std::vector<std::uint8_t> description(text.begin(), text.end());
  pad(description, ' ');
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  out.put(kMagic);
  out.put(kVersion);
  out.put(std::uint64_t(description.size()));
  out.put(std::uint64_t(buffer.bytes().size()));
  out.put_bytes(description.data(), description.size());
  out.put_bytes(buffer.bytes().data(), buffer.bytes().size());
  return bytes;
}

std::string encode(const Tileset3d& set) {
  constexpr double kHalfTurn = std::numbers::pi;
  Json json;
  json["asset"] = {{"version", "1.1"}, {"tilesetVersion", set.version}};
  json["asset"]["extras"] = {
      {"generator", "tind"}, {"name", set.name}, {"attribution", set.attribution}};
  if (!set.accuracy.empty()) json["asset"]["extras"]["accuracy"] = accuracy_json(set.accuracy);
  // Of nothing drawn, and of the root, which has no content: both always to be refined.
  json["geometricError"] = 4 * set.geometric_error;
  json["schema"] = schema();
  Json root;
  root["boundingVolume"] = region(-kHalfTurn, kHalfTurn, set);
  root["geometricError"] = 2 * set.geometric_error;
  root["refine"] = "REPLACE";
  root["children"] =
      Json::array({hemisphere("west", -kHalfTurn, 0, set), hemisphere("east", 0, kHalfTurn, set)});
  json["root"] = std::move(root);
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace tind::proto
