#include "proto/tile/tile_json.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "proto/json_member.h"
#include "proto/json_text.h"

namespace tind::proto {

std::string encode_tile_json(const TileJson& t) {
  const auto& [west, south, east, north] = t.bounds;
  const std::array<double, 2> middle = {(west + east) / 2, (south + north) / 2};
  const auto& [lon, lat] = t.center ? *t.center : middle;
  nlohmann::ordered_json json = {
      {"tilejson", "3.0.0"},    {"name", t.name},
      {"tiles", {t.tiles}},     {"scheme", "xyz"},
      {"minzoom", t.minzoom},   {"maxzoom", t.maxzoom},
      {"bounds", t.bounds},     {"center", {lon, lat, std::max(t.minzoom, t.maxzoom - 2)}},
      {"tileSize", t.tile_size}};
  if (!t.encoding.empty()) json["encoding"] = t.encoding;
  json["format"] = t.format;
  for (const auto& [key, word] : t.words) json[key] = word;
  for (const auto& [key, number] : t.numbers) json[key] = number;
  if (!t.accuracy.empty()) json["accuracy"] = accuracy_json(t.accuracy);
  if (!t.attribution.empty()) json["attribution"] = t.attribution;
  return json::to_text(json, -1) + "\n";
}

namespace {

constexpr int kDeepest = 30;  // level that TileJSON has a number for

/// Of what is no rectangle, one without extent.
std::array<double, 4> bounds_of(const nlohmann::ordered_json& value) {
  std::array<double, 4> bounds{};
  if (!value.is_array() || value.size() != bounds.size()) return bounds;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const auto number = json::as_number(value[i]);
    if (!number) return {};
    bounds[i] = *number;
  }
  return bounds;
}

}  // namespace

Result<TileJson> decode_tile_json(std::string_view text) {
  const auto json = json::parse<nlohmann::ordered_json>(text);
  if (!json.is_object()) return fail(Errc::bad_data, "not a TileJSON object");
  constexpr std::array kOther = {"tilejson", "name", "scheme", "attribution"};
  TileJson t;
  t.maxzoom = -1;
  for (const auto& [key, value] : json.items()) {
    const auto word = json::as_text(value);
    const auto number = json::as_number(value);
    if (key == "encoding" && word)
      t.encoding = *word;
    else if (key == "format" && word)
      t.format = *word;
    else if (key == "tileSize")
      t.tile_size = int(json::as_whole(value, 0, 1 << 16).value_or(0));
    else if (key == "minzoom")
      t.minzoom = int(json::as_whole(value, 0, kDeepest).value_or(0));
    else if (key == "maxzoom")
      t.maxzoom = int(json::as_whole(value, 0, kDeepest).value_or(-1));
    else if (key == "bounds")
      t.bounds = bounds_of(value);
    else if (std::ranges::find(kOther, key) != kOther.end())
      continue;
    else if (word)
      t.words.emplace_back(key, *word);
    else if (number)
      t.numbers.emplace_back(key, *number);
  }
  return t;
}

}  // namespace tind::proto
