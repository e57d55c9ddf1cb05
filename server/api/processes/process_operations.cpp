#include "server/api/processes/process_operations.h"

#include <nlohmann/json.hpp>

#include "server/api/openapi/openapi_parts.h"
#include "server/api/processes/list_page.h"
#include "server/api/processes/pages.h"
#include "server/api/responses.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr const char* kSummary = R"({
  "type": "object",
  "required": ["id", "version"],
  "properties": {
    "id": {"type": "string"}, "title": {"type": "string"}, "description": {"type": "string"},
    "version": {"type": "string"},
    "jobControlOptions": {"type": "array", "items": {"type": "string"}},
    "outputTransmission": {"type": "array", "items": {"type": "string"}},
    "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}},
    "inputs": {"type": "object"}, "outputs": {"type": "object"}
  }})";

http::Operation with_scope(http::Operation operation) {
  operation.tag = "Processes";
  operation.scope = http::Scope::jobs;
  operation.heeds_access = true;
  operation.ignores_others = true;
  return operation;
}

/// {"inputs": {...}, "outputs": {...}, "response": "raw"} of this process.
std::string body_schema(const Process& process) {
  Ordered inputs = {{"type", "object"},
                    {"required", Ordered::array()},
                    {"additionalProperties", false},
                    {"properties", Ordered::object()}};
  const Ordered described = process.inputs();
  for (const auto& [name, input] : described.items()) {
    Ordered& schema = inputs["properties"][name] = input["schema"];
    if (input.contains("description")) schema["description"] = input["description"];
    if (input.value("minOccurs", 0) > 0) inputs["required"].push_back(name);
  }
  Ordered outputs = {{"type", "object"},
                     {"description", "which are wanted; the first without it"},
                     {"additionalProperties", false},
                     {"properties", Ordered::object()}};
  const Ordered made = process.outputs();
  for (const auto& [name, output] : made.items())
    outputs["properties"][name] = {{"type", "object"}, {"description", output.value("title", "")}};
  return Ordered{{"type", "object"},
                 {"required", {"inputs"}},
                 {"additionalProperties", false},
                 {"properties",
                  {{"inputs", std::move(inputs)},
                   {"outputs", std::move(outputs)},
                   {"response",
                    {{"type", "string"},
                     {"enum", {"raw", "document"}},
                     {"description", "the one output as it is, or JSON with all"}}}}}}
      .dump();
}

/// What a request needs beside dataset and area; of processes that are not here there is no
/// example.
struct Example {
  std::string_view id, inputs;
};
constexpr Example kExamples[] = {
    {"simplify", R"("max_error": 10, )"},
    {"contours", R"("interval": 100, )"},
    {"slope", R"("unit": "percent", )"},
    {"hillshade", R"("altitude": 30, )"},
    {"refine", R"("inside": 5, "window": [-121.8, 46.82, -121.72, 46.89], )"},
    {"compare", R"("methods": ["bounded", "qem"], "max_error": [20], )"},
    {"measure",
     R"("mesh": {"value": "v -121.78 46.84 3000\nv -121.74 46.84 3000\nv -121.74 46.87 3000\nf 1 2 3\n", "encoding": "utf-8", "mediaType": "model/obj"}, )"}};

std::string example_of(std::string_view id) {
  for (const Example& example : kExamples)
    if (example.id == id)
      return R"({"inputs": {"dataset": "alps", )" + std::string(example.inputs) +
             R"("bbox": [-121.78, 46.84, -121.74, 46.87]}})";
  return {};
}

std::string capital(std::string name) {
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (i > 0 && name[i - 1] != '-') continue;
    if (name[i] >= 'a' && name[i] <= 'z') name[i] = char(name[i] - 32);
  }
  std::erase(name, '-');
  return name;
}

}  // namespace

http::Operation processes_operation() {
  return with_page(with_scope({.id = "getProcesses",
                               .summary = "What can be done for a client",
                               .numbers = page_numbers(),
                               .responses = json_answer("All processes.", R"({
         "type": "object",
         "required": ["processes", "links"],
         "properties": {"processes": {"type": "array", "items": )" + std::string(kSummary) +
                                                                              R"(},
           "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})")}));
}

http::Operation process_operation() {
  Ordered ids = Ordered::array();
  for (const Process& p : processes()) ids.push_back(p.id);
  return with_page(
      with_scope({.id = "getProcess",
                  .summary = "What a process takes and makes",
                  .path = {{"id", "the name of a process",
                            Ordered{{"type", "string"}, {"enum", ids}}.dump(), R"("simplify")"}},
                  .responses = json_answer("Its inputs and outputs.", kSummary)}));
}

http::Operation execute_operation(const Process& process) {
  std::vector<http::Response> responses = result_responses();
  responses.push_back({201,
                       "A job, with `Prefer: respond-async`; `Location` is where it is.",
                       {{"application/json", kJobRef}}});
  return with_scope({.id = "execute" + capital(process.id),
                     .summary = process.title,
                     .about = process.description,
                     .body = {{"application/json", body_schema(process), example_of(process.id)}},
                     .responses = std::move(responses)});
}

http::Operation no_process_operation() {
  http::Operation operation = with_scope({});
  operation.is_hidden = true;
  return operation;
}

std::vector<http::Response> result_responses() {
  return {{200,
           "The output, in the format that was asked for, or a document of several.",
           {{"application/json", R"({"type": "object"})"}, {"*/*"}}},
          {422,
           "The DEM, or this part of it, does not allow it.",
           {{"application/problem+json", kProblemRef}}}};
}

}  // namespace tind::api
