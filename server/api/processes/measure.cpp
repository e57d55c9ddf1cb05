// The process `measure`: how far is a mesh that the client sends from a dataset?

#include <algorithm>
#include <nlohmann/json.hpp>

#include "proto/base64.h"
#include "server/api/processes/area_input.h"
#include "server/api/processes/order_reading.h"
#include "terrain/base/enum_names.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

/// Of the formats that are read, the only one of a media type; null: none, or several.
const MeshFormat* format_of_type(std::string_view type) {
  type = type.substr(0, type.find(';'));
  const MeshFormat* found = nullptr;
  for (const MeshFormat& f : mesh_formats()) {
    if (!f.decode || type != f.media_type || type == MeshFormat().media_type) continue;
    if (found) return nullptr;
    found = &f;
  }
  return found;
}

/// The value as OGC API - Processes, Part 1, has binary ones: base64 as it is, or qualified.
struct SentMesh {
  std::string value;
  bool encoded = true;
  const MeshFormat* format = nullptr;  // of its media type; null: not said
};

SentMesh read_qualified(const Json& json, Problems& problems) {
  SentMesh mesh;
  Members members(json, "mesh", problems);
  const Json* const value = members.member("value", Members::Need::must);
  if (value && value->is_string())
    mesh.value = value->get<std::string>();
  else if (value)
    problems.add("mesh.value", "must be text: the file's bytes in base64");
  if (const Json* const encoding = members.member("encoding")) {
    mesh.encoded = *encoding == "base64";
    if (!mesh.encoded && *encoding != "utf-8")
      problems.add("mesh.encoding", "must be base64, or utf-8 for a file of text");
  }
  if (const Json* const type = members.member("mediaType")) {
    mesh.format = type->is_string() ? format_of_type(type->get_ref<const std::string&>()) : nullptr;
    if (!mesh.format && !(type->is_string() && *type == MeshFormat().media_type))
      problems.add("mesh.mediaType", "is no type of a mesh that is read: say mesh_format instead");
  }
  members.nothing_else();
  return mesh;
}

void read_mesh_input(OrderReading& reading) {
  const Json* const json = reading.inputs().member("mesh", Members::Need::must);
  const Json* const named = reading.inputs().member("mesh_format");
  if (!json) return;
  SentMesh mesh;
  if (json->is_string())
    mesh.value = json->get<std::string>();
  else if (json->is_object())
    mesh = read_qualified(*json, reading.problems());
  else
    return reading.problems().add("mesh", "must be the file in base64, or {\"value\": ...}");
  const auto names = mesh_formats_to_read();
  if (named) {
    const Json as_said = {{"mesh_format", *named}};
    Members members(as_said, "", reading.problems());
    const std::string name = read_word("mesh_format", names, members, reading.problems(), "");
    for (const MeshFormat& f : mesh_formats())
      if (name == f.name) mesh.format = &f;
  }
  if (mesh.encoded && !proto::decode_base64(mesh.value))
    return reading.problems().add("mesh", "is no base64 (RFC 4648, with padding)");
  if (mesh.value.empty()) return reading.problems().add("mesh", "is empty");
  if (!mesh.format) {
    if (!reading.problems().empty()) return;
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
    return reading.problems().add("mesh_format", "missing: one of " + all);
  }
  const std::string file = std::string("mesh") + mesh.format->extensions.front();
  (mesh.encoded ? reading.order.encoded_files : reading.order.files)[file] = std::move(mesh.value);
  reading.order.arguments.push_back(file);
}

std::expected<JobOrder, Problems> order_of_inputs(const App& app, const Json& json) {
  OrderReading reading("measure", app, json);
  read_mesh_input(reading);  // its file comes before the DEM's
  reading.box();
  if (json.is_object() && json.contains("frame"))
    reading.option("--frame", read_word("frame", enum_names<MeshFrame>(), reading.inputs(),
                                        reading.problems(), name_of(MeshFrame::source)));
  if (json.is_object() && json.contains("units"))
    reading.option("--units", read_word("units", {"metres", "source"}, reading.inputs(),
                                        reading.problems(), "metres"));
  reading.datum();
  reading.option("--threads", "1");
  reading.report();
  return reading.done();
}

Ordered inputs_described() {
  Ordered inputs;
  describe_dem(inputs);
  const Ordered bytes = {{"type", "string"}, {"contentEncoding", "base64"}};
  inputs["mesh"] = described(
      "Mesh",
      "the file, in base64; or {\"value\": ..., \"mediaType\": \"model/obj\"}, with \"encoding\": "
      "\"utf-8\" a file of text as it is",
      {{"oneOf",
        {bytes,
         {{"type", "object"},
          {"required", {"value"}},
          {"additionalProperties", false},
          {"properties",
           {{"value", {{"type", "string"}}},
            {"mediaType", {{"type", "string"}}},
            {"encoding",
             {{"type", "string"}, {"enum", {"base64", "utf-8"}}, {"default", "base64"}}}}}}}}},
      1);
  inputs["mesh_format"] = described("Format of the mesh", "where no media type says it",
                                    {{"type", "string"}, {"enum", mesh_formats_to_read()}});
  inputs["frame"] =
      described("Frame", "the mesh's x and y; without it as its file says, else source",
                {{"type", "string"}, {"enum", enum_names<MeshFrame>()}});
  inputs["units"] = described(
      "Unit of z", "metres, or source (the DEM's own); without it as the file says, else metres",
      {{"type", "string"}, {"enum", {"metres", "source"}}});
  describe_area(inputs);
  inputs.erase("polygon");
  describe_datum(inputs);
  return inputs;
}

Ordered outputs_described() {
  return {{"report", report_output("Its error against every post, and what is wrong with it")}};
}

}  // namespace

Process measure_process() {
  return {"measure",
          "Measure a mesh",
          "The vertical error of a mesh, whoever made it, against every post of a DEM.",
          inputs_described,
          outputs_described,
          order_of_inputs};
}

}  // namespace tind::api
