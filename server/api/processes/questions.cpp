// The processes that ask a DEM something: profile, line-of-sight, viewshed, volume, statistics,
// difference.

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/api/processes/area_input.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/order_reading.h"
#include "server/api/processes/plain_inputs.h"
#include "server/api/processes/process.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostPlaces = 1000;

constexpr FileKind kProfiles[] = {{"csv", "text/csv"},
                                  {"geojson", "application/geo+json"},
                                  {"json", "application/json"},
                                  {"covjson", "application/prs.coverage+json"}};
constexpr FileKind kTables[] = {{"csv", "text/csv"}, {"json", "application/json"}};
constexpr FileKind kRasters[] = {{"tif", "image/tiff; application=geotiff"}, {"asc", "text/plain"}};

constexpr NumberInput kSamples = {
    "samples", "--samples", "Samples", "so many heights at equal distances", 2, 1e6, kNone};
constexpr NumberInput kStep = {
    "step", "--step", "Step", "a height every so many metres, and at the end", 1e-3, 1e7, kNone};
constexpr NumberInput kSight[] = {
    {"from_height", "--from-height", "Height of the observer's eye", "above the ground, metres", 0,
     1e5, 1.7},
    {"to_height", "--to-height", "Height of the target", "above the ground, metres", 0, 1e5, 0},
    {"refraction", "--refraction", "Refraction",
     "of the ray's curve and the earth's; 0: a straight line", -1, 1, 0.13},
    {"uncertainty", "--uncertainty", "Uncertainty",
     "the DEM's posts are within so many metres of the truth: what that leaves open depends on it",
     0, 1e5, 0}};
constexpr NumberInput kRadius = {"radius", "--radius", "Radius", "no farther than so many metres",
                                 1e-3,     2e6,        kNone};

constexpr NumberInput kHeight = {
    "height", "--height", "Height", "against this height, metres as the DEM's are",
    -2e4,     2e4,        kNone};
constexpr NumberInput kDifferenceUncertainty = {
    "uncertainty",
    "--uncertainty",
    "Uncertainty",
    "heights (differences, of two datasets) are within so many metres of the truth",
    0,
    1e5,
    0};
constexpr NumberInput kBase = {
    "base", "--base", "Base", "volumes are between the surface and this height, metres",
    -2e4,   2e4,      0};

std::expected<JobOrder, Problems> profile_order(const App& app, const Json& json) {
  OrderReading reading("profile", app, json);
  reading.option("--line", read_line("line", 2, kMostPlaces, reading.inputs(), reading.problems()));
  reading.crs();
  const Json* const samples = reading.inputs().member("samples");
  if (samples && samples->is_number_integer() && *samples >= kSamples.low &&
      *samples <= kSamples.high)
    reading.option(kSamples.flag, samples->dump());
  else if (samples)
    reading.problems().add("samples", "must be a whole number from 2 to 1000000");
  reading.number(kStep);
  if (samples && json.contains("step"))
    reading.problems().add("step", "and samples are two ways to say which places: one of them");
  reading.level();
  reading.datum();
  reading.file("profile", kProfiles);
  return reading.done();
}

std::expected<JobOrder, Problems> line_of_sight_order(const App& app, const Json& json) {
  OrderReading reading("line-of-sight", app, json);
  reading.place("from", "--from");
  reading.place("to", "--to");
  reading.crs();
  for (const NumberInput& number : kSight) reading.number(number);
  reading.level();
  reading.report();
  return reading.done();
}

std::expected<JobOrder, Problems> viewshed_order(const App& app, const Json& json) {
  OrderReading reading("viewshed", app, json);
  reading.place("from", "--from");
  reading.crs();
  for (const NumberInput& number : kSight) reading.number(number);
  reading.number(kRadius);
  reading.level();
  reading.file("viewshed", kRasters);
  reading.report();
  reading.option("--progress", "lines");
  reading.option("--threads", "1");
  return reading.done();
}

std::expected<JobOrder, Problems> volume_order(const App& app, const Json& json) {
  OrderReading reading("volume", app, json);
  reading.number(kHeight);
  reading.area("--area");
  reading.plane();
  reading.other("against", "--against");
  if (json.contains("height") + json.contains("plane") + json.contains("against") != 1)
    reading.problems().add("height", "takes one of height, plane and against");
  reading.number(kDifferenceUncertainty);
  reading.level();
  reading.datum();
  reading.report();
  reading.option("--progress", "lines");
  return reading.done();
}

std::expected<JobOrder, Problems> statistics_order(const App& app, const Json& json) {
  OrderReading reading("statistics", app, json);
  const std::string crs = read_places_crs(reading.inputs(), reading.problems());
  std::string polygons = read_geojson("polygons", reading.inputs(), reading.problems(), crs);
  if (!json.contains("polygons"))
    reading.problems().add("polygons", "missing: polygons of GeoJSON, or Features of such");
  reading.order.files["polygons.geojson"] = std::move(polygons);
  reading.option("--polygons", "polygons.geojson");
  reading.number(kBase);
  reading.datum();
  reading.file("statistics", kTables);
  reading.option("--progress", "lines");
  return reading.done();
}

std::expected<JobOrder, Problems> difference_order(const App& app, const Json& json) {
  OrderReading reading("difference", app, json);
  if (!json.contains("less"))
    reading.problems().add("less", "missing: the dataset to be taken off");
  reading.other("less", "--less");
  reading.box();
  reading.datum();
  reading.file("difference", kRasters);
  reading.report();
  reading.option("--progress", "lines");
  return reading.done();
}

// --- how they are described ----------------------------------------------------------------------

Ordered described_crs() {
  return described("CRS of places", "CRS84 (longitude, latitude) or EPSG:CODE; x before y",
                   {{"type", "string"}, {"default", "CRS84"}});
}

Ordered profile_inputs() {
  Ordered all;
  describe_dem(all);
  all["line"] =
      describe_line("Line", "places [x, y] in crs; geodesics between them", 2, kMostPlaces);
  all["crs"] = described_crs();
  all["samples"] = describe_number(kSamples);
  all["samples"]["schema"]["type"] = "integer";
  all["step"] = describe_number(kStep);
  describe_level(all);
  describe_datum(all);
  all["format"] = describe_format(kProfiles);
  return all;
}

Ordered sight_inputs() {
  Ordered all;
  describe_dem(all);
  all["from"] = describe_place("Observer", "where he stands: [x, y] in crs");
  all["to"] = describe_place("Target", "where it stands: [x, y] in crs");
  all["crs"] = described_crs();
  for (const NumberInput& number : kSight) all[number.name] = describe_number(number);
  describe_level(all);
  return all;
}

Ordered viewshed_inputs() {
  Ordered all = sight_inputs();
  all.erase("to");
  all["radius"] = describe_number(kRadius);
  all["format"] = describe_format(kRasters);
  return all;
}

Ordered volume_inputs() {
  Ordered all;
  describe_dem(all);
  all["height"] = describe_number(kHeight);
  all["plane"] = described(
      "Plane", "against the plane through three points [x, y, z], x and y in crs",
      {{"type", "array"},
       {"minItems", 3},
       {"maxItems", 3},
       {"items",
        {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}}}});
  all["against"] = described("Dataset to compare with", "by its name", {{"type", "string"}});
  all["against_layer"] = described("Its layer", "where it has several", {{"type", "string"}});
  describe_area(all);
  all["uncertainty"] = describe_number(kDifferenceUncertainty);
  describe_level(all);
  describe_datum(all);
  return all;
}

Ordered statistics_inputs() {
  Ordered all;
  describe_dem(all);
  all["polygons"] =
      described("Polygons", "of GeoJSON, in crs: a row for each feature", {{"type", "object"}}, 1);
  all["crs"] = described_crs();
  all["base"] = describe_number(kBase);
  describe_datum(all);
  all["format"] = describe_format(kTables);
  return all;
}

Ordered difference_inputs() {
  Ordered all;
  describe_dem(all);
  all["less"] = described("Dataset to be taken off", "by its name", {{"type", "string"}}, 1);
  all["less_layer"] = described("Its layer", "where it has several", {{"type", "string"}});
  describe_area(all);
  all.erase("polygon");
  describe_datum(all);
  all["format"] = describe_format(kRasters);
  return all;
}

Ordered profile_outputs() {
  return {{"profile", file_output("Heights along the line, with their distances")}};
}
Ordered sight_outputs() {
  return {{"report", report_output("visible, hidden or depends; clearance and where it is least")}};
}
Ordered viewshed_outputs() {
  return {{"viewshed", file_output("0 hidden, 1 visible, 2 depends, 255 nothing")},
          {"report", report_output("How many posts of each")}};
}

Ordered volume_outputs() {
  return {{"report", report_output("cut, fill and net volume, each with what it can be; areas")}};
}
Ordered statistics_outputs() { return {{"statistics", file_output("A row for each feature")}}; }
Ordered difference_outputs() {
  return {{"difference", file_output("dataset - less, metres, on the grid of dataset")},
          {"report", report_output("Least, greatest, mean, deviation, RMS")}};
}

}  // namespace

std::vector<Process> question_processes() {
  return {{"profile", "Profile",
           "Heights along a line: sampled, or wherever the surface along the line turns.",
           profile_inputs, profile_outputs, profile_order},
          {"line-of-sight", "Line of sight",
           "Whether one place sees another, with the earth's curve, exactly over the DEM's "
           "surface; with an uncertainty, or over a level of tiles, what is certain.",
           sight_inputs, sight_outputs, line_of_sight_order},
          {"viewshed", "Viewshed", "The posts that can be seen from a place.", viewshed_inputs,
           viewshed_outputs, viewshed_order},
          {"volume", "Volume", "Cut and fill of an area, against a height, a plane or a dataset.",
           volume_inputs, volume_outputs, volume_order},
          {"statistics", "Statistics",
           "Heights, area and volume inside each polygon (zonal statistics).", statistics_inputs,
           statistics_outputs, statistics_order},
          {"difference", "Difference", "One dataset less another, as a raster.", difference_inputs,
           difference_outputs, difference_order}};
}

}  // namespace tind::api
