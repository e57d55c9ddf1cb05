#include "server/api/processes/plain_inputs.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "server/api/processes/dem_inputs.h"
#include "terrain/mesh/mesh_file.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

/// "7.5,45.9"; empty: no position.
std::string position(const Json& json) {
  if (!json.is_array() || json.size() != 2) return {};
  for (const Json& v : json)
    if (!v.is_number() || !std::isfinite(v.get<double>())) return {};
  return Ordered(json[0].get<double>()).dump() + "," + Ordered(json[1].get<double>()).dump();
}

Ordered position_schema() {
  return {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 2}, {"maxItems", 2}};
}

}  // namespace

void read_number(const NumberInput& number, Members& inputs, services::JobOrder& order,
                 Problems& problems) {
  if (!inputs.member(number.name)) return;
  double value = 0;
  const std::size_t before = problems.list().size();
  inputs.number(number.name, number.low, number.high, value);
  if (problems.list().size() == before)
    order.arguments.push_back(std::string(number.flag) + "=" + Ordered(value).dump());
}

Ordered describe_number(const NumberInput& n) {
  Ordered schema = {{"type", "number"}, {"minimum", n.low}, {"maximum", n.high}};
  if (n.initial == n.initial) schema["default"] = n.initial;
  return described(n.title, n.description, std::move(schema));
}

std::vector<std::string> extensions(std::span<const FileKind> kinds) {
  std::vector<std::string> all;
  for (const FileKind& kind : kinds) all.emplace_back(kind.extension);
  return all;
}

Ordered describe_format(std::span<const FileKind> kinds) {
  return described(
      "Format", "of the file",
      {{"type", "string"}, {"enum", extensions(kinds)}, {"default", kinds.front().extension}});
}

std::vector<std::string> mesh_formats_to_write() {
  std::vector<std::string> names;
  for (const MeshFormat& f : mesh_formats())
    if (f.encode) names.push_back(f.name);
  return names;
}

std::vector<std::string> mesh_formats_to_read() {
  std::vector<std::string> names;
  for (const MeshFormat& f : mesh_formats())
    if (f.decode) names.push_back(f.name);
  return names;
}

std::string read_place(const char* name, Members& inputs, Problems& problems) {
  const Json* const json = inputs.member(name, Members::Need::must);
  std::string text = json ? position(*json) : "";
  if (json && text.empty()) problems.add(name, "must be [x, y], two numbers");
  return text;
}

std::string line_text(const Json& json, std::size_t least, std::size_t most) {
  std::string text;
  bool good = json.is_array() && json.size() >= least && json.size() <= most;
  for (const Json& place : good ? json : Json::array()) {
    const std::string one = position(place);
    good = good && !one.empty();
    text += (text.empty() ? "" : " ") + one;
  }
  return good ? text : "";
}

std::string read_line(const char* name, std::size_t least, std::size_t most, Members& inputs,
                      Problems& problems) {
  const Json* const json = inputs.member(name, Members::Need::must);
  if (!json) return {};
  if (std::string text = line_text(*json, least, most); !text.empty()) return text;
  problems.add(name, "must be a list of " + std::to_string(least) + " to " + std::to_string(most) +
                         " places [x, y]");
  return {};
}

Ordered describe_place(const char* title, const char* description) {
  return described(title, description, position_schema(), 1);
}

Ordered describe_line(const char* title, const char* description, std::size_t least,
                      std::size_t most) {
  return described(
      title, description,
      {{"type", "array"}, {"items", position_schema()}, {"minItems", least}, {"maxItems", most}},
      1);
}

}  // namespace tind::api
