// The process `compare`: an area of a dataset, or a terrain mesh, by several methods, as one table.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "server/api/processes/area_input.h"
#include "server/api/processes/mesh_input.h"
#include "server/api/processes/order_reading.h"
#include "terrain/simplify/methods.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

constexpr std::size_t kMostMethods = 16, kMostStops = 8;
/// As the command compares them.
constexpr const char* kUsual[] = {"bounded", "memoryless", "qem", "greedy", "cluster"};

/// What a mesh that is sent has not.
constexpr const char* kOfDatasets[] = {"dataset", "layer", "bbox", "polygon", "crs", "datum"};

constexpr FileKind kTables[] = {{"csv", "text/csv"}, {"html", "text/html; charset=utf-8"}};

/// Where all methods stop: lists, of which a request has one.
struct StopList {
  const char *name, *flag, *title, *description;
  double low, high;
  bool whole, percent;
};
constexpr StopList kStops[] = {
    {"max_error", "--max-error", "Stops: errors",
     "the fewest triangles within each of these vertical errors of every post, metres", 0, 1e6,
     false, false},
    {"triangles", "--at", "Stops: triangles", "at most so many triangles", 1, 1e9, true, false},
    {"ratio", "--at", "Stops: shares", "at most such shares of the full mesh's triangles", 1e-9, 1,
     false, true}};

/// "1,5,20"; empty: not so many numbers of this range.
std::string list_text(const StopList& stop, const Json& json) {
  std::string text;
  if (!json.is_array() || json.empty() || json.size() > kMostStops) return {};
  for (const Json& one : json) {
    const bool number = stop.whole ? one.is_number_integer() : one.is_number();
    const double value = number ? one.get<double>() : -1;
    if (!(value >= stop.low && value <= stop.high)) return {};
    text += (text.empty() ? "" : ",") +
            (stop.percent ? fmt::format("{:.12g}%", 100 * value) : Ordered(value).dump());
  }
  return text;
}

void read_stops(OrderReading& reading) {
  int given = 0;
  for (const StopList& stop : kStops) {
    const Json* const json = reading.inputs().member(stop.name);
    if (!json) continue;
    ++given;
    const std::string text = list_text(stop, *json);
    if (text.empty())
      reading.problems().add(
          stop.name, fmt::format("must be a list of 1 to {} {}numbers from {} "
                                 "to {}",
                                 kMostStops, stop.whole ? "whole " : "", stop.low, stop.high));
    else
      reading.option(stop.flag, text);
  }
  if (given != 1)
    reading.problems().add("max_error",
                           std::string(given == 0 ? "missing: " : "") +
                               "takes one of max_error, triangles and ratio, each a list" +
                               (given == 0 ? "" : ", not more"));
}

void read_methods(OrderReading& reading) {
  const Json* const json = reading.inputs().member("methods");
  if (!json) return;
  if (!json->is_array() || json->empty() || json->size() > kMostMethods)
    return reading.problems().add(
        "methods",
        fmt::format("must be a list of 1 to {} names; /methods lists all", kMostMethods));
  std::string text;
  for (const Json& one : *json) {
    const auto known = one.is_string()
                           ? method_variant(one.get_ref<const std::string&>())
                           : fail(Errc::invalid_argument, "must be names; /methods lists all");
    if (!known) return reading.problems().add("methods", known.error().what);
    text += (text.empty() ? "" : ",") + one.get<std::string>();
  }
  reading.option("--methods", text);
}

/// Which part of it, above what, and what its page is called.
void read_dataset(OrderReading& reading, const Json& json) {
  reading.area("--boundary", OrderReading::Polygon::with_its_box);
  reading.datum();
  const Json* const name =
      json.is_object() && json.contains("dataset") ? &json["dataset"] : nullptr;
  if (name && name->is_string())
    reading.option("--title", "Simplifying " + name->get<std::string>());
}

std::expected<JobOrder, Problems> order_of_inputs(const App& app, const Json& json) {
  const bool mesh = json.is_object() && json.contains("mesh");
  OrderReading reading("compare", app, json,
                       mesh ? OrderReading::Of::mesh : OrderReading::Of::dataset);
  read_methods(reading);
  read_stops(reading);
  if (mesh)
    reading.none_of_datasets(kOfDatasets);
  else
    read_dataset(reading, json);
  reading.report();
  const std::string format = read_word("format", extensions(kTables), reading.inputs(),
                                       reading.problems(), kTables[0].extension);
  if (mesh && format == "html")
    reading.problems().add("format", "html has pictures of a DEM: of a mesh the table is csv");
  for (const FileKind& kind : kTables)
    if (format == kind.extension)
      reading.order.outputs.push_back({"table", "table." + format, kind.media_type});
  reading.option(("--" + format).c_str(), "table." + format);
  for (const char* const word : {"--progress=lines", "--threads=1"})
    reading.order.arguments.push_back(word);
  return reading.done();
}

Ordered inputs_described() {
  Ordered inputs;
  describe_dem(inputs);
  inputs["dataset"]["minOccurs"] = 0;  // or mesh
  describe_mesh(inputs, 0);
  inputs["mesh"]["description"] =
      "in place of a dataset: a terrain mesh (heights over a plane), whose vertices are what "
      "errors "
      "are of; " +
      inputs["mesh"]["description"].get<std::string>();
  Ordered name = {{"type", "string"}};
  inputs["methods"] = described("Methods",
                                "by their names, or as method:variant (vertex-removal:degree); "
                                "/methods lists all; of a mesh all "
                                "but cluster",
                                {{"type", "array"},
                                 {"items", std::move(name)},
                                 {"minItems", 1},
                                 {"maxItems", kMostMethods},
                                 {"default", kUsual}});
  for (const StopList& stop : kStops)
    inputs[stop.name] = described(stop.title, stop.description,
                                  {{"type", "array"},
                                   {"items",
                                    {{"type", stop.whole ? "integer" : "number"},
                                     {"minimum", stop.low},
                                     {"maximum", stop.high}}},
                                   {"minItems", 1},
                                   {"maxItems", kMostStops}});
  describe_area(inputs);
  describe_datum(inputs);
  inputs["format"] = describe_format(kTables);
  inputs["format"]["description"] =
      "of the table as a file; html: a page with curves and pictures, which stands alone, of a "
      "dataset";
  return inputs;
}

Ordered outputs_described() {
  return {{"report", report_output("The table: a row for each method and stop")},
          {"table", file_output("The same as CSV, or as a page")}};
}

}  // namespace

Process compare_process() {
  return {
      "compare",
      "Compare methods",
      "Several methods on an area of a DEM, or on a TIN that is sent, as one table of size, error "
      "and time: to choose one.",
      inputs_described,
      outputs_described,
      order_of_inputs};
}

}  // namespace tind::api
