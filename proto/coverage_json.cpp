// The text is put together piece by piece: a tree of a million values would take a hundred times
// their bytes.

#include "proto/coverage_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "proto/text_put.h"

namespace tind::proto {
namespace {

using Ordered = nlohmann::ordered_json;

Ordered parameter_json(const CoverageParameter& p) {
  return {
      {"type", "Parameter"},
      {"description", {{"en", p.description}}},
      {"unit",
       {{"label", {{"en", p.unit_name}}},
        {"symbol", {{"value", p.unit_symbol}, {"type", "http://www.opengis.net/def/uom/UCUM/"}}}}},
      {"observedProperty", {{"id", p.property}, {"label", {{"en", p.property_name}}}}}};
}

Ordered referencing_json(const CoverageJson& c) {
  const Ordered order = c.east_first ? Ordered{"x", "y"} : Ordered{"y", "x"};
  return Ordered::array(
      {{{"coordinates", order},
        {"system", {{"type", c.geographic ? "GeographicCRS" : "ProjectedCRS"}, {"id", c.crs}}}}});
}

Ordered axis_json(const CoverageAxis& axis) {
  if (axis.count == 1) return {{"values", {axis.first}}};
  return {{"start", axis.first}, {"stop", axis.last}, {"num", axis.count}};
}

void put_places(std::string& out, const CoverageJson& c) {
  out += R"({"composite":{"dataType":"tuple","coordinates":["x","y"],"values":[)";
  for (std::size_t i = 0; i < c.places.size(); ++i) {
    if (i > 0) out += ',';
    out += '[';
    text::put_text(out, c.places[i][0]);
    out += ',';
    text::put_text(out, c.places[i][1]);
    out += ']';
  }
  out += "]}}";
}

void put_domain(std::string& out, const CoverageJson& c) {
  const bool grid = c.places.empty();
  out += R"({"type":"Domain","domainType":")";
  out += grid ? "Grid" : c.point ? "Point" : "MultiPoint";
  out += R"(","axes":)";
  if (grid)
    out += json::to_text(Ordered{{"x", axis_json(c.x)}, {"y", axis_json(c.y)}});
  else if (c.point)
    out += json::to_text(
        Ordered{{"x", {{"values", {c.places[0][0]}}}}, {"y", {{"values", {c.places[0][1]}}}}});
  else
    put_places(out, c);
  out += R"(,"referencing":)" + json::to_text(referencing_json(c)) + "}";
}

void put_range(std::string& out, const CoverageJson& c) {
  out += R"({"type":"NdArray","dataType":"float")";
  if (c.places.empty())
    out += R"(,"axisNames":["y","x"],"shape":[)" + std::to_string(c.y.count) + "," +
           std::to_string(c.x.count) + "]";
  else if (!c.point)
    out += R"(,"axisNames":["composite"],"shape":[)" + std::to_string(c.places.size()) + "]";
  out += R"(,"values":[)";
  for (std::size_t i = 0; i < c.values.size(); ++i) {
    if (i > 0) out += ',';
    if (std::isnan(c.values[i]))
      out += "null";
    else
      text::put_text(out, c.values[i]);
  }
  out += "]}";
}

}  // namespace

std::string encode_parameter(const CoverageParameter& p) {
  return json::to_text(parameter_json(p));
}

std::string encode_coverage_json(const CoverageJson& c) {
  const std::string name = json::to_text(Ordered(c.parameter.name));
  std::string out = R"({"type":"Coverage","domain":)";
  put_domain(out, c);
  out += R"(,"parameters":{)" + name + ":" + encode_parameter(c.parameter) + "}";
  out += R"(,"ranges":{)" + name + ":";
  put_range(out, c);
  out += "}";
  if (c.max_error_m) {
    out += R"(,"tind:max_error_m":)";
    text::put_text(out, *c.max_error_m);
  }
  if (c.off_m) {
    out += R"(,"tind:max_off_m":)";
    text::put_text(out, *c.off_m);
  }
  return out + "}\n";
}

}  // namespace tind::proto
