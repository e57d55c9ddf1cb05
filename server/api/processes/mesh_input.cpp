#include "server/api/processes/mesh_input.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "proto/base64.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/plain_inputs.h"
#include "terrain/mesh/mesh_file.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

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

SentMesh read_qualified(const Json& json, const std::string& name, Problems& problems) {
  SentMesh mesh;
  Members members(json, name, problems);
  const Json* const value = members.member("value", Members::Need::must);
  if (value && value->is_string())
    mesh.value = value->get<std::string>();
  else if (value)
    problems.add(name + ".value", "must be text: the file's bytes in base64");
  if (const Json* const encoding = members.member("encoding")) {
    mesh.encoded = *encoding == "base64";
    if (!mesh.encoded && *encoding != "utf-8")
      problems.add(name + ".encoding", "must be base64, or utf-8 for a file of text");
  }
  if (const Json* const type = members.member("mediaType")) {
    mesh.format = type->is_string() ? format_of_type(type->get_ref<const std::string&>()) : nullptr;
    if (!mesh.format && !(type->is_string() && *type == MeshFormat().media_type))
      problems.add(name + ".mediaType",
                   "is no type of a mesh that is read: say " + name + "_format instead");
  }
  members.nothing_else();
  return mesh;
}

}  // namespace

void read_mesh(Members& inputs, services::JobOrder& order, Problems& problems,
               const std::string& input) {
  const std::string format_input = input + "_format";
  const Json* const json = inputs.member(input.c_str(), Members::Need::must);
  const Json* const named = inputs.member(format_input.c_str());
  if (!json) return;
  SentMesh mesh;
  if (json->is_string())
    mesh.value = json->get<std::string>();
  else if (json->is_object())
    mesh = read_qualified(*json, input, problems);
  else
    return problems.add(input, "must be the file in base64, or {\"value\": ...}");
  const auto names = mesh_formats_to_read();
  if (named) {
    const Json as_said = {{format_input, *named}};
    Members members(as_said, "", problems);
    const std::string name = read_word(format_input.c_str(), names, members, problems, "");
    for (const MeshFormat& f : mesh_formats())
      if (name == f.name) mesh.format = &f;
  }
  if (mesh.encoded && !proto::decode_base64(mesh.value))
    return problems.add(input, "is no base64 (RFC 4648, with padding)");
  if (mesh.value.empty()) return problems.add(input, "is empty");
  if (!mesh.format) {
    if (!problems.empty()) return;
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
    return problems.add(format_input, "missing: one of " + all);
  }
  const std::string file = input + mesh.format->extensions.front();
  (mesh.encoded ? order.encoded_files : order.files)[file] = std::move(mesh.value);
  order.arguments.push_back(file);
}

void describe_mesh(Ordered& inputs, int least, const std::string& input, const char* title) {
  const Ordered bytes = {{"type", "string"}, {"contentEncoding", "base64"}};
  inputs[input] = described(
      title,
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
      least);
  inputs[input + "_format"] = described("Format of the mesh", "where no media type says it",
                                        {{"type", "string"}, {"enum", mesh_formats_to_read()}});
}

}  // namespace tind::api
