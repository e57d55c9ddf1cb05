// The process `simplify`: an area of a dataset as one mesh, by any method, until any of its stops.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>
#include <variant>

#include "server/api/processes/area_input.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/mesh_input.h"
#include "server/api/processes/plain_inputs.h"
#include "server/api/processes/process.h"
#include "terrain/base/enum_names.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/simplify/constraints/voids.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

constexpr const char* kDefaultFormat = "ply";
/// What a mesh that is sent has not.
constexpr const char* kOfDems[] = {"dataset",    "layer",   "bbox",  "polygon", "crs",
                                   "breaklines", "flatten", "frame", "datum"};
/// That the command line has and a client must not: files, and what the daemon decides.
constexpr const char* kNotForClients[] = {"drape"};

// --- the options of methods ----------------------------------------------------------------------

/// One option of a method: its type as JSON Schema has it.
struct OptionInput {
  std::string name, help;
  Ordered schema;
};

template <class T>
Ordered schema_of(const T& initial) {
  if constexpr (std::is_same_v<T, bool>)
    return {{"type", "boolean"}, {"default", initial}};
  else if constexpr (std::is_same_v<T, int>)
    return {{"type", "integer"}, {"default", initial}};
  else if constexpr (std::is_same_v<T, double>)
    return {{"type", "number"}, {"default", initial}};
  else if constexpr (NamedEnum<T>)
    return {{"type", "string"}, {"enum", enum_names<T>()}, {"default", name_of(initial)}};
  else
    return nullptr;
}

std::vector<OptionInput> options_of(const MethodOptions& method) {
  std::vector<OptionInput> all;
  std::visit(
      [&](auto options) {
        options.each_option([&](const std::string& name, auto member, const char* help) {
          if (std::ranges::find(kNotForClients, name) != std::end(kNotForClients)) return;
          Ordered schema = schema_of(options.*member);
          if (!schema.is_null()) all.push_back({name, help, std::move(schema)});
        });
      },
      method);
  return all;
}

/// Of an option that two methods have: the words of both, and no default that would be one's.
void merge_words(Ordered& schema, const Ordered& other) {
  if (!schema.contains("enum") || !other.contains("enum") || schema["enum"] == other["enum"])
    return;
  for (const auto& word : other["enum"])
    if (std::ranges::find(schema["enum"], word) == schema["enum"].end())
      schema["enum"].push_back(word);
  schema.erase("default");
}

/// Every option, once, with the methods that read it.
std::vector<OptionInput> all_options() {
  std::vector<OptionInput> all;
  for (const MethodOptions& method : all_methods()) {
    for (OptionInput& option : options_of(method)) {
      const std::string owner = method_name(method);  // most name it themselves
      if (!option.help.starts_with(owner)) option.help = owner + ": " + option.help;
      const auto known = std::ranges::find(all, option.name, &OptionInput::name);
      if (known != all.end()) {
        known->help += "; " + option.help;
        merge_words(known->schema, option.schema);
        continue;
      }
      all.push_back(std::move(option));
    }
  }
  return all;
}

/// "--alpha=0.5"; a problem where the value is not of its type.
void read_option(const OptionInput& option, const Json& value, std::vector<std::string>& words,
                 Problems& problems) {
  const std::string type = option.schema["type"];
  const std::string flag = "--" + option.name;
  if (type == "boolean") {
    if (!value.is_boolean()) return problems.add(option.name, "must be true or false");
    if (value.get<bool>()) words.push_back(flag);
  } else if (type == "string") {
    const auto names = option.schema["enum"].get<std::vector<std::string>>();
    if (!value.is_string() || std::ranges::find(names, value.get<std::string>()) == names.end())
      return problems.add(option.name, "must be one of " + option.schema["enum"].dump());
    words.push_back(flag + "=" + value.get<std::string>());
  } else {
    const bool good = type == "integer" ? value.is_number_integer() : value.is_number();
    if (!good)
      return problems.add(
          option.name, "must be " + std::string(type == "integer" ? "a whole " : "a ") + "number");
    words.push_back(flag + "=" + value.dump());
  }
}

// --- what is asked -------------------------------------------------------------------------------

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const MethodInfo& m : methods()) names.push_back(m.name);
  return names;
}

void read_stop(Members& inputs, std::vector<std::string>& words, Problems& problems) {
  struct Stop {
    const char *name, *flag;
    double low, high;
  };
  constexpr Stop kStops[] = {{"triangles", "--triangles", 1, 1e9},
                             {"ratio", "--ratio", 1e-9, 1},
                             {"max_error", "--max-error", 0, 1e6}};
  int given = 0;
  for (const Stop& stop : kStops) {
    const Json* const json = inputs.member(stop.name);
    if (!json) continue;
    ++given;
    const bool whole = std::string_view(stop.name) == "triangles";
    const bool number = whole ? json->is_number_integer() : json->is_number();
    if (!number || !(json->get<double>() >= stop.low && json->get<double>() <= stop.high))
      problems.add(stop.name,
                   std::string("must be a ") + (whole ? "whole " : "") + "number from " +
                       (whole ? "1 to 1000000000"
                              : Ordered(stop.low).dump() + " to " + Ordered(stop.high).dump()));
    else
      words.push_back(std::string(stop.flag) + "=" + json->dump());
  }
  if (given == 0) problems.add("max_error", "missing: takes one of max_error, triangles and ratio");
  if (given > 1) problems.add("max_error", "takes one of max_error, triangles and ratio, not more");
}

/// method, and its options by their names.
void read_method(Members& inputs, JobOrder& order, Problems& problems) {
  const std::string method =
      read_word("method", method_names(), inputs, problems, method_name(MethodOptions{}));
  order.arguments.push_back("--method=" + method);
  std::vector<OptionInput> own;
  if (const auto chosen = method_named(method)) own = options_of(*chosen);
  for (const OptionInput& option : all_options()) {
    const Json* const value = inputs.member(option.name.c_str());
    if (!value) continue;
    const auto mine = std::ranges::find(own, option.name, &OptionInput::name);
    if (mine == own.end())
      problems.add(option.name, "is no option of " + method);
    else
      read_option(*mine, *value, order.arguments, problems);
  }
}

/// What comes of it, and how it is run.
void add_outputs(const std::string& stem, const std::string& format, JobOrder& order) {
  const MeshFormat& f = **format_to_write("", format);
  const std::string file = stem + f.extensions.front();
  order.outputs = {{"mesh", file, f.media_type}, {"report", "report.json", "application/json"}};
  for (const char* const word : {"--report=report.json", "--progress=lines", "--threads=1"})
    order.arguments.push_back(word);
  order.arguments.push_back("--output=" + file);
  order.arguments.push_back("--format=" + format);
}

/// Of a terrain mesh that the client sends: its error is that over its vertices.
std::expected<JobOrder, Problems> order_of_mesh(const Json& json) {
  Problems problems;
  Members inputs(json, "", problems);
  JobOrder order;
  order.process = "simplify";
  order.arguments = {"simplify"};
  read_mesh(inputs, order, problems);
  order.arguments.push_back("--terrain");
  read_stop(inputs, order.arguments, problems);
  read_method(inputs, order, problems);
  const std::string format =
      read_word("format", mesh_formats_to_write(), inputs, problems, kDefaultFormat);
  for (const char* const name : kOfDems)
    if (inputs.member(name))
      problems.add(name, "is for datasets: a mesh that is sent is taken as it is");
  inputs.nothing_else();
  if (!problems.empty()) return std::unexpected(std::move(problems));
  add_outputs("simplified", format, order);
  return order;
}

std::expected<JobOrder, Problems> order_of_inputs(const App& app, const Json& json) {
  if (json.is_object() && json.contains("mesh")) return order_of_mesh(json);
  Problems problems;
  Members inputs(json, "", problems);
  JobOrder order;
  order.process = "simplify";
  order.arguments = {"simplify"};

  const DemOfJob dem = read_dem(app, inputs, problems);
  read_stop(inputs, order.arguments, problems);
  read_method(inputs, order, problems);
  const AreaInput area = read_area(inputs, problems);
  if (!area.bounds.empty()) {
    order.arguments.push_back("--bounds=" + area.bounds);
    order.arguments.push_back("--bounds-crs=" + area.crs);
  }
  if (!area.polygon.empty()) {
    order.files["area.geojson"] = area.polygon;
    order.arguments.push_back("--boundary=area.geojson");
  }
  for (const char* const lines : {"breaklines", "flatten"}) {
    std::string text = read_geojson(lines, inputs, problems, area.crs);
    if (text.empty()) continue;
    const std::string file = std::string(lines) + ".geojson";
    order.files[file] = std::move(text);
    order.arguments.push_back(std::string("--") + lines + "=" + file);
  }

  const std::string voids = read_word("voids", enum_names<Voids>(), inputs, problems, "");
  if (!voids.empty()) order.arguments.push_back("--voids=" + voids);
  order.arguments.push_back("--frame=" + read_word("frame", enum_names<MeshFrame>(), inputs,
                                                   problems, name_of(MeshFrame::source)));
  if (const std::string datum = read_datum(app, dem, inputs, problems); !datum.empty())
    order.arguments.push_back("--to-datum=" + datum);
  const std::string format =
      read_word("format", mesh_formats_to_write(), inputs, problems, kDefaultFormat);
  inputs.nothing_else();
  if (!problems.empty()) return std::unexpected(std::move(problems));

  add_outputs("mesh", format, order);
  add_dem(dem, order);
  return order;
}

// --- how it is described -------------------------------------------------------------------------

Ordered inputs_described() {
  Ordered inputs;
  describe_dem(inputs);
  inputs["dataset"]["minOccurs"] = 0;  // or mesh
  describe_mesh(inputs, 0);
  inputs["mesh"]["description"] =
      "in place of a dataset: a terrain mesh (heights over a plane), whose vertices are what the "
      "error is of; " +
      inputs["mesh"]["description"].get<std::string>();
  inputs["max_error"] = described(
      "Stop: error", "the fewest triangles within this vertical error of every post, metres",
      {{"type", "number"}, {"minimum", 0}});
  inputs["triangles"] = described("Stop: triangles", "at most this many triangles",
                                  {{"type", "integer"}, {"minimum", 1}});
  inputs["ratio"] = described("Stop: share", "at most this share of the full mesh's triangles",
                              {{"type", "number"}, {"exclusiveMinimum", 0}, {"maximum", 1}});
  inputs["method"] = described(
      "Method", "who simplifies; /methods says which to take for what",
      {{"type", "string"}, {"enum", method_names()}, {"default", method_name(MethodOptions{})}});
  describe_area(inputs);
  inputs["breaklines"] =
      described("Breaklines", "lines of GeoJSON, in crs, that become edges", {{"type", "object"}});
  inputs["flatten"] = described("Level polygons", "polygons of GeoJSON, in crs, that become level",
                                {{"type", "object"}});
  inputs["voids"] = described(
      "Voids", "cover closes them, and no valid post is left out; keep leaves them open",
      {{"type", "string"}, {"enum", enum_names<Voids>()}, {"default", name_of(Voids::cover)}});
  inputs["format"] = described(
      "Format", "of the mesh",
      {{"type", "string"}, {"enum", mesh_formats_to_write()}, {"default", kDefaultFormat}});
  inputs["frame"] = described("Frame",
                              "source: the DEM's own CRS; metric: metres east and north of the "
                              "area's first post",
                              {{"type", "string"},
                               {"enum", enum_names<MeshFrame>()},
                               {"default", name_of(MeshFrame::source)}});
  describe_datum(inputs);
  for (const OptionInput& option : all_options())
    inputs[option.name] = described("Option of a method", option.help, option.schema);
  return inputs;
}

Ordered outputs_described() {
  return {
      {"mesh",
       {{"title", "The mesh"}, {"schema", {{"type", "string"}, {"contentEncoding", "binary"}}}}},
      {"report",
       {{"title", "What it is: triangles, measured error, CRS, datum, volume"},
        {"schema", {{"type", "object"}}}}}};
}

}  // namespace

Process simplify_process() {
  return {"simplify",
          "Simplify an area of a dataset, or a terrain mesh",
          "One triangle mesh of a DEM or a part of it, or of a TIN that is sent, by any method, "
          "within an error or a number of triangles; its error is measured against every post, or "
          "vertex.",
          inputs_described,
          outputs_described,
          order_of_inputs};
}

}  // namespace tind::api
