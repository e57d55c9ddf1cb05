// The processes that make a raster, a picture or lines of a DEM: slope, aspect, hillshade,
// roughness, tri, tpi, relief, contours.

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/api/processes/area_input.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/plain_inputs.h"
#include "server/api/processes/process.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

constexpr FileKind kRasters[] = {{"tif", "image/tiff; application=geotiff"}, {"asc", "text/plain"}};
constexpr FileKind kPictures[] = {{"tif", "image/tiff; application=geotiff"}, {"png", "image/png"}};
constexpr FileKind kVectors[] = {{"gpkg", "application/geopackage+sqlite3"},
                                 {"fgb", "application/flatgeobuf"},
                                 {"geojson", "application/geo+json"}};

constexpr NumberInput kLight[] = {
    {"azimuth", "--azimuth", "Azimuth", "where the light comes from, degrees clockwise from north",
     0, 360, 315},
    {"altitude", "--altitude", "Altitude", "of the light above the horizon, degrees", 0, 90, 45},
    {"z_factor", "--z-factor", "Factor of heights", "by which heights are multiplied", 1e-6, 1e6,
     1}};

constexpr NumberInput kColours[] = {
    {"low", "--low", "Lowest",
     "the height of the first colour, metres; without it the lowest post's", -2e4, 2e4,
     std::numeric_limits<double>::quiet_NaN()},
    {"high", "--high", "Highest", "the height of the last one; without it the highest post's", -2e4,
     2e4, std::numeric_limits<double>::quiet_NaN()}};

constexpr NumberInput kBandError = {
    "max_error",
    "--max-error",
    "Error of the band's mesh",
    "with as_band: of a mesh with as few triangles as keep every post within so many metres",
    1e-3,
    1e5,
    std::numeric_limits<double>::quiet_NaN()};

/// What all of them take: where, and as what; then the DEM.
void finish(const App& app, const DemOfJob& dem, std::span<const FileKind> kinds, const char* stem,
            Members& inputs, JobOrder& order, Problems& problems) {
  const AreaInput area = read_area(inputs, problems);
  if (!area.polygon.empty())
    problems.add("polygon", "is for meshes: a raster's area is a rectangle, bbox");
  if (!area.bounds.empty()) {
    order.arguments.push_back("--bounds=" + area.bounds);
    order.arguments.push_back("--bounds-crs=" + area.crs);
  }
  if (const std::string datum = read_datum(app, dem, inputs, problems); !datum.empty())
    order.arguments.push_back("--to-datum=" + datum);
  const std::string format =
      read_word("format", extensions(kinds), inputs, problems, kinds.front().extension);
  inputs.nothing_else();
  if (!problems.empty()) return;
  const std::string file = std::string(stem) + "." + format;
  order.arguments.push_back("--output=" + file);
  order.arguments.push_back("--progress=lines");
  for (const FileKind& kind : kinds)
    if (format == kind.extension) order.outputs = {{stem, file, kind.media_type}};
  add_dem(dem, order);
}

std::expected<JobOrder, Problems> raster_order(const char* id, const App& app, const Json& json) {
  Problems problems;
  Members inputs(json, "", problems);
  JobOrder order;
  order.process = id;
  order.arguments = {id};
  const DemOfJob dem = read_dem(app, inputs, problems);
  const std::string_view kind = id;
  if (kind == "hillshade")
    for (const NumberInput& number : kLight) read_number(number, inputs, order, problems);
  if (kind == "slope" &&
      read_word("unit", {"degree", "percent"}, inputs, problems, "degree") == "percent")
    order.arguments.push_back("--percent");
  finish(app, dem, kRasters, "raster", inputs, order, problems);
  if (!problems.empty()) return std::unexpected(std::move(problems));
  return order;
}

std::expected<JobOrder, Problems> relief_order(const App& app, const Json& json) {
  Problems problems;
  Members inputs(json, "", problems);
  JobOrder order;
  order.process = "relief";
  order.arguments = {"relief"};
  const DemOfJob dem = read_dem(app, inputs, problems);
  for (const NumberInput& number : kLight) read_number(number, inputs, order, problems);
  for (const NumberInput& number : kColours) read_number(number, inputs, order, problems);
  finish(app, dem, kPictures, "relief", inputs, order, problems);
  if (!problems.empty()) return std::unexpected(std::move(problems));
  return order;
}

std::expected<JobOrder, Problems> contours_order(const App& app, const Json& json) {
  Problems problems;
  Members inputs(json, "", problems);
  JobOrder order;
  order.process = "contours";
  order.arguments = {"contours"};
  const DemOfJob dem = read_dem(app, inputs, problems);
  constexpr NumberInput kInterval = {"interval", "--interval", "", "", 1e-3, 1e5, 0};
  constexpr NumberInput kBase = {"base", "--base", "", "", -1e5, 1e5, 0};
  read_number(kInterval, inputs, order, problems);
  read_number(kBase, inputs, order, problems);
  const Json* const levels = inputs.member("levels");
  if (levels) {
    std::string text;
    bool good = levels->is_array() && !levels->empty() && levels->size() <= 1000;
    for (const Json& level : good ? *levels : Json::array()) {
      good = good && level.is_number();
      text += (text.empty() ? "" : ",") + level.dump();
    }
    if (good)
      order.arguments.push_back("--levels=" + text);
    else
      problems.add("levels", "must be a list of at most 1000 numbers, metres");
  }
  const bool interval = json.contains("interval");
  if (interval == (levels != nullptr))
    problems.add("interval", interval ? "and levels are two ways to say which heights: one of them"
                                      : "missing: takes interval or levels, metres");
  const Json* const band = inputs.member("as_band");
  const bool areas = band && *band == true;
  if (band && !band->is_boolean()) problems.add("as_band", "must be true or false");
  if (areas) order.arguments.push_back("--as-band");
  read_number(kBandError, inputs, order, problems);
  read_level(app, dem, inputs, order, problems);
  const bool mesh = json.contains("max_error"), tiles = json.contains("level");
  if (areas && mesh == tiles)
    problems.add("max_error", mesh ? "and level are two ways to say what is known: one of them"
                                   : "missing: as_band takes it, metres, or a level of tiles");
  if (!areas && (mesh || tiles)) problems.add(mesh ? "max_error" : "level", "is for as_band");
  finish(app, dem, kVectors, "contours", inputs, order, problems);
  if (!problems.empty()) return std::unexpected(std::move(problems));
  return order;
}

Ordered with_area(Ordered inputs, std::span<const FileKind> kinds) {
  Ordered all;
  describe_dem(all);
  for (auto& [name, input] : inputs.items()) all[name] = std::move(input);
  describe_area(all);
  all.erase("polygon");
  describe_datum(all);
  all["format"] = describe_format(kinds);
  return all;
}

Ordered raster_inputs() { return with_area(Ordered::object(), kRasters); }
Ordered slope_inputs() {
  Ordered unit = {{"type", "string"}, {"enum", {"degree", "percent"}}, {"default", "degree"}};
  return with_area({{"unit", described("Unit", "of the slope", std::move(unit))}}, kRasters);
}
Ordered hillshade_inputs() {
  Ordered light;
  for (const NumberInput& number : kLight) light[number.name] = describe_number(number);
  return with_area(std::move(light), kRasters);
}
Ordered relief_inputs() {
  Ordered own;
  for (const NumberInput& number : kLight) own[number.name] = describe_number(number);
  for (const NumberInput& number : kColours) own[number.name] = describe_number(number);
  return with_area(std::move(own), kPictures);
}
Ordered contour_inputs() {
  Ordered own;
  own["interval"] = described("Interval", "so many metres apart",
                              {{"type", "number"}, {"minimum", 1e-3}, {"maximum", 1e5}});
  own["base"] = described("Base", "one of the heights of interval, metres",
                          {{"type", "number"}, {"default", 0}});
  own["levels"] = described(
      "Heights", "in place of interval: these, metres",
      {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 1}, {"maxItems", 1000}});
  own["as_band"] = described(
      "Band",
      "areas in place of lines: where the DEM can have the height, when all that is known "
      "of it is a mesh within max_error, or a level of tiles",
      {{"type", "boolean"}, {"default", false}});
  own[kBandError.name] = describe_number(kBandError);
  describe_level(own);
  return with_area(std::move(own), kVectors);
}

Ordered output(const char* name, const char* title) {
  return {
      {name, {{"title", title}, {"schema", {{"type", "string"}, {"contentEncoding", "binary"}}}}}};
}
Ordered raster_output() { return output("raster", "The raster, on the DEM's own grid"); }
Ordered relief_output() { return output("relief", "The picture, a pixel a post"); }
Ordered contour_output() {
  return output("contours",
                "Lines with the field height_m; a band: polygons with height_m and error_m");
}

template <const auto& kId>
std::expected<JobOrder, Problems> order_of(const App& app, const Json& json) {
  return raster_order(kId, app, json);
}

constexpr char kSlope[] = "slope", kAspect[] = "aspect", kHillshade[] = "hillshade",
               kRoughness[] = "roughness", kTri[] = "tri", kTpi[] = "tpi";

}  // namespace

std::vector<Process> raster_processes() {
  return {{kSlope, "Slope", "How steep an area of a DEM is, as a raster: Horn's gradient.",
           slope_inputs, raster_output, order_of<kSlope>},
          {kAspect, "Aspect", "Where its slopes face, degrees clockwise from north.", raster_inputs,
           raster_output, order_of<kAspect>},
          {kHillshade, "Hillshade", "An area of a DEM lit from a side.", hillshade_inputs,
           raster_output, order_of<kHillshade>},
          {kRoughness, "Roughness", "The largest difference of heights around each post.",
           raster_inputs, raster_output, order_of<kRoughness>},
          {kTri, "Ruggedness", "Terrain ruggedness index of Riley.", raster_inputs, raster_output,
           order_of<kTri>},
          {kTpi, "Topographic position", "Height above the mean of the neighbours.", raster_inputs,
           raster_output, order_of<kTpi>},
          {"relief", "Relief", "Heights as colours, lit from a side, as a picture.", relief_inputs,
           relief_output, relief_order},
          {"contours", "Contours",
           "Lines of equal height of an area of a DEM; or, as a band, the areas in which they "
           "certainly lie when all that is known is a mesh and its error.",
           contour_inputs, contour_output, contours_order}};
}

}  // namespace tind::api
