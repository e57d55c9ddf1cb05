// layer.json: written with every field that some client requires (CesiumJS, cesium-native, QGIS and
// 3d-tiles-renderer each need different ones; docs/formats.md has the table), read leniently.

#include "proto/tile/layer_json.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proto/json_member.h"
#include "proto/json_text.h"

namespace tind::proto {
namespace {

using Json = nlohmann::ordered_json;
using Level = std::vector<TileRange>;

constexpr int kDeepestLevel = 30;  // beyond it, columns leave 32 bits

Json to_json(const TileRange& r) {
  return {{"startX", r.start_x}, {"startY", r.start_y}, {"endX", r.end_x}, {"endY", r.end_y}};
}

/// Reads members of one object; remembers the first thing that is wrong.
class Fields {
 public:
  explicit Fields(const Json& object) : object_(object) {}

  const std::string& error() const { return error_; }
  void reject(const std::string& why) {
    if (error_.empty()) error_ = "layer.json: " + why;
  }
  const Json* find(const char* key) const {
    const Json* const value = json::member(object_, key);
    return value && !value->is_null() ? value : nullptr;
  }
  void text(const char* key, std::string& out) {
    const Json* value = find(key);
    if (!value) return;
    auto text = json::as_text(*value);
    if (!text) return reject(std::string(key) + " is not a string");
    out = std::move(*text);
  }
  void texts(const char* key, std::vector<std::string>& out) {
    const Json* value = find(key);
    if (!value) return;
    if (!value->is_array()) return reject(std::string(key) + " is not an array of strings");
    out.clear();
    for (const Json& item : *value) {
      auto text = json::as_text(item);
      if (!text) return reject(std::string(key) + " is not an array of strings");
      out.push_back(std::move(*text));
    }
  }
  void level(const char* key, int& out) {
    const Json* value = find(key);
    if (!value) return;
    const auto level = json::as_whole(*value, 0, kDeepestLevel);
    if (!level)
      return reject(std::string(key) + " is not a level, 0.." + std::to_string(kDeepestLevel));
    out = int(*level);
  }
  void bounds(std::array<double, 4>& out) {
    const Json* value = find("bounds");
    if (!value) return;
    if (!value->is_array() || value->size() != 4) return reject("bounds are not four numbers");
    for (std::size_t i = 0; i < 4; ++i) {
      const auto degrees = json::as_number((*value)[i]);
      if (!degrees) return reject("bounds are not four numbers");
      out[i] = *degrees;
    }
  }
  void available(std::vector<Level>& out) {
    const Json* value = find("available");
    if (!value) return;
    if (!value->is_array() || value->size() > kDeepestLevel + 1)
      return reject("available is not an array of at most 31 levels");
    for (const Json& level : *value) {
      out.emplace_back();
      if (!level.is_array()) return reject("a level of available is not an array");
      for (const Json& range : level) {
        TileRange r;
        if (!read_range(range, r))
          return reject("available, level " + std::to_string(out.size() - 1) +
                        ": not a range {startX, startY, endX, endY}");
        out.back().push_back(r);
      }
    }
  }

  void accuracy(std::vector<StatedAccuracy>& out) {
    const Json* value = find("accuracy");
    if (!value) return;
    if (!value->is_array()) return reject("accuracy is not an array");
    for (const Json& one : *value) {
      StatedAccuracy read;
      if (!read_accuracy(one, read)) return reject("accuracy: not {layer, kind, m}");
      out.push_back(std::move(read));
    }
  }

 private:
  static bool read_accuracy(const Json& one, StatedAccuracy& out) {
    if (!one.is_object()) return false;
    const Json* const metres = json::member(one, "m");
    const auto number = metres ? json::as_number(*metres) : std::nullopt;
    if (!number || !(*number >= 0)) return false;
    out.metres = *number;
    for (const auto& [key, text] : {std::pair("layer", &out.layer), std::pair("kind", &out.kind)})
      if (const Json* const value = json::member(one, key)) {
        auto read = json::as_text(*value);
        if (!read) return false;
        *text = std::move(*read);
      }
    return true;
  }
  static bool read_number(const Json& range, const char* key, std::uint32_t& out) {
    const auto n = json::whole(range, key, 0, std::numeric_limits<std::uint32_t>::max());
    if (n) out = std::uint32_t(*n);
    return n.has_value();
  }
  static bool read_range(const Json& range, TileRange& r) {
    return read_number(range, "startX", r.start_x) && read_number(range, "startY", r.start_y) &&
           read_number(range, "endX", r.end_x) && read_number(range, "endY", r.end_y) &&
           r.start_x <= r.end_x && r.start_y <= r.end_y;
  }

  const Json& object_;
  std::string error_;
};

}  // namespace

bool LayerJson::contains(int z, std::uint32_t x, std::uint32_t y) const {
  if (z < 0 || std::size_t(z) >= available.size()) return false;
  return std::ranges::any_of(available[std::size_t(z)], [&](const TileRange& r) {
    return x >= r.start_x && x <= r.end_x && y >= r.start_y && y <= r.end_y;
  });
}

Json accuracy_json(const std::vector<StatedAccuracy>& stated) {
  Json all = Json::array();
  for (const StatedAccuracy& one : stated) {
    Json json = Json::object();
    if (!one.layer.empty()) json["layer"] = one.layer;
    json["kind"] = one.kind;
    json["m"] = one.metres;
    all.push_back(std::move(json));
  }
  return all;
}

std::string encode_layer_json(const LayerJson& layer) {
  Json available = Json::array();
  for (const Level& level : layer.available) {
    Json ranges = Json::array();
    for (const TileRange& range : level) ranges.push_back(to_json(range));
    available.push_back(std::move(ranges));
  }
  Json json = {{"tilejson", "2.1.0"},
               {"name", layer.name},
               {"description", layer.description},
               {"attribution", layer.attribution},
               {"version", layer.version},
               {"format", layer.format},
               {"scheme", layer.scheme},
               {"projection", layer.projection},
               {"tiles", layer.tiles},
               {"bounds", layer.bounds},
               {"minzoom", layer.minzoom},
               {"maxzoom", layer.maxzoom},
               {"extensions", layer.extensions},
               {"available", std::move(available)}};
  if (layer.metadata_availability > 0) json["metadataAvailability"] = layer.metadata_availability;
  if (layer.side != "both") json["side"] = layer.side;
  if (!layer.datum.empty()) json["datum"] = layer.datum;
  if (!layer.accuracy.empty()) json["accuracy"] = accuracy_json(layer.accuracy);
  // A name that is not UTF-8 (a file name can be anything) must not stop the tiles.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<LayerJson> decode_layer_json(std::string_view text) {
  const Json json = json::parse<Json>(text);
  if (json.is_discarded() || !json.is_object())
    return fail(Errc::bad_data, "layer.json: not a JSON object");
  LayerJson layer;
  Fields fields(json);
  if (!fields.find("format")) fields.reject("no format");
  if (!fields.find("tiles")) fields.reject("no tiles");
  fields.text("format", layer.format);
  if (!layer.format.starts_with("quantized-mesh-1."))
    fields.reject("format is " + layer.format + ", not quantized-mesh-1.x");
  fields.text("name", layer.name);
  fields.text("description", layer.description);
  fields.text("attribution", layer.attribution);
  fields.text("version", layer.version);
  fields.text("scheme", layer.scheme);
  fields.text("projection", layer.projection);
  fields.texts("tiles", layer.tiles);
  if (layer.tiles.empty()) fields.reject("tiles is empty");
  fields.texts("extensions", layer.extensions);
  fields.bounds(layer.bounds);
  fields.available(layer.available);
  fields.level("minzoom", layer.minzoom);
  layer.maxzoom = std::max(0, int(layer.available.size()) - 1);
  fields.level("maxzoom", layer.maxzoom);
  fields.level("metadataAvailability", layer.metadata_availability);
  fields.text("side", layer.side);
  fields.text("datum", layer.datum);
  fields.accuracy(layer.accuracy);
  if (!fields.error().empty()) return fail(Errc::bad_data, fields.error());
  return layer;
}

}  // namespace tind::proto
