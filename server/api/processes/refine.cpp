// The process `refine`: a dataset as one mesh that is fine in a region and coarse elsewhere. The
// resource /refine makes such a mesh at once, for a client that draws it; this is for files: in any
// format and frame, of more posts, with a report of both errors.

#include <nlohmann/json.hpp>

#include "server/api/processes/area_input.h"
#include "server/api/processes/order_reading.h"
#include "terrain/base/enum_names.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

constexpr const char* kDefaultFormat = "ply";
constexpr std::size_t kMostPlaces = 1000;
constexpr double kInside = 1, kOutside = 50;  // as the command has them
constexpr NumberInput kErrors[] = {
    {"inside", "--inside", "Error inside", "of every post in the region, metres", 0, 1e6, kInside},
    {"outside", "--outside", "Error outside", "of every other post, metres; not below inside", 0,
     1e6, kOutside}};
constexpr NumberInput kWidth = {
    "width", "--width", "Width", "of the corridor along the route, metres", 1e-3, 1e6, 0};

/// "[west, south, east, north]" in degrees as --bbox and --bounds take it; east beyond 180 where
/// the rectangle crosses the antimeridian. Empty, and a problem: none.
std::string rectangle(const char* name, const Json& json, Problems& problems) {
  double box[4] = {};
  bool good = json.is_array() && json.size() == 4;
  for (std::size_t i = 0; good && i < 4; ++i) {
    good = json[i].is_number();
    if (good) box[i] = json[i];
  }
  good = good && box[0] >= -180 && box[0] <= 180 && box[2] >= -180 && box[2] <= 360 &&
         box[1] >= -90 && box[1] < box[3] && box[3] <= 90;
  if (!good) {
    problems.add(name, "must be [west, south, east, north], degrees");
    return {};
  }
  if (box[2] < box[0]) box[2] += 360;
  std::string text;
  for (const double v : box) text += (text.empty() ? "" : ",") + Ordered(v).dump();
  return text;
}

/// The ring of a Polygon that has one.
std::string ring(const Json& json) {
  const bool polygon = json.is_object() && json.value("type", Json()) == "Polygon" &&
                       json.contains("coordinates") && json["coordinates"].is_array() &&
                       json["coordinates"].size() == 1;
  return polygon ? line_text(json["coordinates"][0], 4, kMostPlaces) : "";
}

void read_region(OrderReading& reading, const Json& json) {
  Members& inputs = reading.inputs();
  Problems& problems = reading.problems();
  const Json* const box = inputs.member("bbox");
  const Json* const polygon = inputs.member("polygon");
  const Json* const route = inputs.member("route");
  if ((box != nullptr) + (polygon != nullptr) + (route != nullptr) != 1)
    problems.add("bbox", "takes one of bbox, polygon and route, which say where it is to be fine");
  if (box) reading.option("--bbox", rectangle("bbox", *box, problems));
  if (polygon) {
    const std::string text = ring(*polygon);
    if (text.empty())
      problems.add("polygon", "must be a Polygon of GeoJSON of one ring, in degrees");
    reading.option("--polygon", text);
  }
  if (route) reading.option("--route", read_line("route", 2, kMostPlaces, inputs, problems));
  reading.number(kWidth);
  if (route && !json.contains("width"))
    problems.add("width", "missing: of the corridor along the route, metres");
  if (!route && json.contains("width")) problems.add("width", "is for a route");
}

std::expected<JobOrder, Problems> order_of_inputs(const App& app, const Json& json) {
  OrderReading reading("refine", app, json);
  Problems& problems = reading.problems();
  read_region(reading, json);
  for (const NumberInput& number : kErrors) reading.number(number);
  const auto error = [&](const char* name, double initial) {
    return json.contains(name) && json[name].is_number() ? json[name].get<double>() : initial;
  };
  if (error("inside", kInside) > error("outside", kOutside))
    problems.add("inside", "must not be above outside");
  if (const Json* const window = reading.inputs().member("window"))
    reading.option("--bounds", rectangle("window", *window, problems));
  reading.option("--frame", read_word("frame", enum_names<MeshFrame>(), reading.inputs(), problems,
                                      name_of(MeshFrame::source)));
  reading.datum();
  const std::string format =
      read_word("format", mesh_formats_to_write(), reading.inputs(), problems, kDefaultFormat);
  const MeshFormat& f = **format_to_write("", format);
  const std::string file = std::string("mesh") + f.extensions.front();
  reading.option("--output", file);
  reading.option("--format", format);
  reading.option("--threads", "1");
  reading.option("--progress", "lines");
  reading.order.outputs.push_back({"mesh", file, f.media_type});
  reading.report();
  return reading.done();
}

Ordered inputs_described() {
  const Ordered numbers = {{"type", "number"}};
  const Ordered box = {{"type", "array"}, {"items", numbers}, {"minItems", 4}, {"maxItems", 4}};
  Ordered inputs;
  describe_dem(inputs);
  inputs["bbox"] = described(
      "Region, as a rectangle",
      "[west, south, east, north], degrees; west may be greater than east, across the antimeridian",
      box);
  inputs["polygon"] =
      described("Region, as a polygon",
                "a Polygon of GeoJSON of one ring, longitudes and latitudes", {{"type", "object"}});
  inputs["route"] = describe_line(
      "Region, as a route", "places [lon, lat]; with width, the corridor along it", 2, kMostPlaces);
  inputs["route"]["minOccurs"] = 0;
  inputs["width"] =
      described(kWidth.title, kWidth.description,
                {{"type", "number"}, {"minimum", kWidth.low}, {"maximum", kWidth.high}});
  for (const NumberInput& number : kErrors) inputs[number.name] = describe_number(number);
  inputs["window"] =
      described("Window", "the part of the DEM that the mesh covers, degrees; without it all", box);
  inputs["format"] = described(
      "Format", "of the mesh",
      {{"type", "string"}, {"enum", mesh_formats_to_write()}, {"default", kDefaultFormat}});
  inputs["frame"] = described("Frame",
                              "source: the DEM's own CRS; metric: metres east and north of the "
                              "window's first post",
                              {{"type", "string"},
                               {"enum", enum_names<MeshFrame>()},
                               {"default", name_of(MeshFrame::source)}});
  describe_datum(inputs);
  return inputs;
}

Ordered outputs_described() {
  return {{"mesh", file_output("The mesh")},
          {"report", report_output("Triangles, and the measured errors inside and outside")}};
}

}  // namespace

Process refine_process() {
  return {
      "refine",
      "Refine a region",
      "One mesh of a DEM that is fine in a region, or along a route, and coarse elsewhere; both "
      "errors are measured against every post.",
      inputs_described,
      outputs_described,
      order_of_inputs};
}

}  // namespace tind::api
