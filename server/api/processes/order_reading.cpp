#include "server/api/processes/order_reading.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "server/api/processes/area_input.h"
#include "server/api/processes/mesh_input.h"

namespace tind::api {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

OrderReading::OrderReading(const char* id, const App& app, const Json& json, Of of)
    : app_(app), of_(of), inputs_(json, "", problems_) {
  order.process = id;
  order.arguments = {id};
  if (of == Of::dataset)
    dem_ = read_dem(app, inputs_, problems_);
  else
    read_mesh(inputs_, order, problems_);
}

void OrderReading::crs() { option("--places-crs", read_places_crs(inputs_, problems_)); }

void OrderReading::datum() {
  if (const std::string datum = read_datum(app_, dem_, inputs_, problems_); !datum.empty())
    option("--to-datum", datum);
}

void OrderReading::area(const char* polygon_flag, Polygon how) {
  const AreaInput area = read_area(inputs_, problems_);
  area_crs_ = area.crs;
  if (!area.bounds.empty() && (area.polygon.empty() || how == Polygon::with_its_box)) {
    option("--bounds", area.bounds);
    option("--bounds-crs", area.crs);
  }
  if (area.polygon.empty()) return;
  order.files["area.geojson"] = area.polygon;
  option(polygon_flag, "area.geojson");
}

void OrderReading::box() {
  const AreaInput area = read_area(inputs_, problems_);
  if (!area.polygon.empty())
    problems_.add("polygon", "is none here: the area is a rectangle, bbox");
  if (area.bounds.empty()) return;
  option("--bounds", area.bounds);
  option("--bounds-crs", area.crs);
}

void OrderReading::plane() {
  const Json* const json = inputs_.member("plane");
  if (!json) return;
  std::string text;
  bool good = json->is_array() && json->size() == 3;
  for (const Json& point : good ? *json : Json::array()) {
    good = good && point.is_array() && point.size() == 3;
    for (std::size_t i = 0; good && i < 3; ++i) {
      good = point[i].is_number();
      if (good) text += Ordered(point[i].get<double>()).dump() + (i < 2 ? "," : " ");
    }
  }
  if (!good) return problems_.add("plane", "must be three points [x, y, z], z in metres");
  option("--plane", text);
  option("--places-crs", area_crs_);
}

void OrderReading::other(const char* name, const char* flag) {
  const Json* const said = inputs_.member(name);
  const std::string layer_name = std::string(name) + "_layer";
  const Json* const layer = inputs_.member(layer_name.c_str());
  if (!said && layer) problems_.add(layer_name, std::string("is for ") + name);
  if (!said) return;
  Json as_dataset = {{"dataset", *said}};
  if (layer) as_dataset["layer"] = *layer;
  Problems wrong;
  Members members(as_dataset, "", wrong);
  other_ = read_dem(app_, members, wrong);
  for (const auto& problem : wrong.list())
    problems_.add(problem.parameter == "layer" ? layer_name : name, problem.detail);
  if (!wrong.empty() || !dem_.recipe) return;
  if (other_.recipe->words != dem_.recipe->words)
    return problems_.add(name,
                         "is opened with other options (datum, nodata, ...) than dataset, so "
                         "that one command cannot read both");
  for (const std::string& file : other_.recipe->files) {
    option(flag, file);
    order.names.emplace_back(file, other_.dataset->name);
  }
}

void OrderReading::file(const char* stem, std::span<const FileKind> kinds) {
  const std::string format =
      read_word("format", extensions(kinds), inputs_, problems_, kinds.front().extension);
  const std::string file = std::string(stem) + "." + format;
  option("--output", file);
  for (const FileKind& kind : kinds)
    if (format == kind.extension) order.outputs.push_back({stem, file, kind.media_type});
}

void OrderReading::report() {
  order.outputs.push_back({"report", "report.json", "application/json"});
  option("--report", "report.json");
}

void OrderReading::none_of_datasets(std::span<const char* const> names) {
  for (const char* const name : names)
    if (inputs_.member(name))
      problems_.add(name, "is for datasets: a mesh that is sent is taken as it is");
}

std::expected<JobOrder, Problems> OrderReading::done() {
  inputs_.nothing_else();
  if (!problems_.empty()) return std::unexpected(std::move(problems_));
  if (of_ == Of::dataset) add_dem(dem_, order);
  return std::move(order);
}

Ordered file_output(const char* title) {
  return {{"title", title}, {"schema", {{"type", "string"}, {"contentEncoding", "binary"}}}};
}

Ordered report_output(const char* title) {
  return {{"title", title}, {"schema", {{"type", "object"}}}};
}

}  // namespace tind::api
