#include "server/api/openapi/openapi_parts.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr const char* kColumn = R"({"type": "integer", "minimum": 0, "maximum": 33554431})";

constexpr const char* kName =
    R"({"type": "string", "pattern": "^[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$"})";
constexpr const char* kLevel = R"({"type": "integer", "minimum": 0, "maximum": 24})";

const http::PathParameter kCommon[] = {
    {"dataset", "the name of a dataset; /datasets lists all", kName, R"("alps")"},
    {"collectionId", "the name of a dataset; /collections lists all", kName, R"("alps")"},
    {"tileMatrixSetId", "how tiles are cut",
     R"({"type": "string", "enum": ["WorldCRS84Quad", "WebMercatorQuad"]})", R"("WorldCRS84Quad")"},
    {"z", "the level, 0 the coarsest", kLevel, "0"},
    {"x", "the column, from the west", kColumn, "0"},
    {"y", "the row: from the south, of images of web maps from the north", kColumn, "0"},
    {"tileMatrix", "the level, 0 the coarsest", kLevel, "0"},
    {"tileRow", "the row, from the north", kColumn, "0"},
    {"tileCol", "the column, from the west", kColumn, "0"},
};

struct Tag {
  const char *name, *about;
};
constexpr Tag kTags[] = {
    {"About", "What there is, and this document"},
    {"Tiles", "Terrain for globes and engines, tile by tile"},
    {"Images", "Web maps: heights as colours, hillshade, slope, aspect"},
    {"Heights", "The height at a place, or at many"},
    {"Heights as other services", "The addresses and forms that clients of other services know"},
    {"OGC", "OGC API: collections, tiles, EDR, coverages"},
    {"Processes", "Work that is done for a client: OGC API - Processes, Part 1"},
    {"Flights and cameras", "What a flight needs, and meshes for a region or a camera"},
    {"Health", "For orchestrators and for Prometheus"},
};

struct Refused {
  const char *status, *about;
};
constexpr Refused kRefused[] = {
    {"400", "A parameter is missing, wrong or not known; `errors` names it."},
    {"401", "The daemon has keys, and the request has none, a wrong one or one that has expired."},
    {"403", "The key is not for this scope, or not for this dataset."},
    {"404", "There is no such dataset, tile or path."},
    {"411", "A body must say its length."},
    {"412", "It is another by now than If-Match names."},
    {"413", "The body is too large."},
    {"415", "The Content-Type of the body is none that this resource takes."},
    {"429", "Too many requests; `Retry-After` says when to ask again."},
    {"500", "The source is damaged, or a fault of the daemon."},
    {"503", "Busy, or still reading; `Retry-After` says when to ask again."},
};

constexpr const char* kProblem = R"({
  "type": "object",
  "description": "RFC 9457",
  "required": ["type", "title", "status", "requestId"],
  "properties": {
    "type": {"type": "string", "format": "uri-reference"},
    "title": {"type": "string"},
    "status": {"type": "integer"},
    "detail": {"type": "string"},
    "instance": {"type": "string"},
    "errors": {
      "type": "array",
      "description": "everything that is wrong, at most the first 20",
      "items": {
        "type": "object",
        "required": ["parameter", "detail"],
        "properties": {"parameter": {"type": "string"}, "detail": {"type": "string"}}
      }
    },
    "requestId": {"type": "string", "description": "with a 5xx, the log has it, too"}
  }
})";

constexpr const char* kJob = R"({
  "type": "object",
  "required": ["jobID", "type", "status"],
  "properties": {
    "jobID": {"type": "string"},
    "processID": {"type": "string"},
    "type": {"const": "process"},
    "status": {"enum": ["accepted", "running", "successful", "failed", "dismissed"]},
    "message": {"type": "string"},
    "progress": {"type": "integer", "minimum": 0, "maximum": 100},
    "created": {"type": "string", "format": "date-time"},
    "started": {"type": "string", "format": "date-time"},
    "finished": {"type": "string", "format": "date-time"},
    "updated": {"type": "string", "format": "date-time"},
    "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}
  }
})";

constexpr const char* kLink = R"({
  "type": "object",
  "required": ["href", "rel"],
  "properties": {
    "href": {"type": "string"},
    "rel": {"type": "string"},
    "type": {"type": "string"},
    "title": {"type": "string"}
  }
})";

constexpr const char* kGeoJson = R"({
  "type": "object",
  "description": "any object of RFC 7946",
  "required": ["type"],
  "properties": {
    "type": {"type": "string"},
    "bbox": {"type": "array", "items": {"type": "number"}},
    "coordinates": {"type": "array"},
    "geometries": {"type": "array"},
    "geometry": {},
    "properties": {},
    "features": {"type": "array"},
    "id": {},
    "heights": {"type": "object", "description": "of an answer: what its heights are"}
  }
})";

}  // namespace

const http::PathParameter* common_path_parameter(std::string_view name) {
  const auto found = std::ranges::find(kCommon, name, &http::PathParameter::name);
  return found == std::end(kCommon) ? nullptr : &*found;
}

Ordered openapi_head() {
  Ordered head = {
      {"openapi", "3.1.0"},
      {"info",
       {{"title", "tind"},
        {"version", TIND_VERSION},
        {"summary", "Terrain whose error is known"},
        {"description",
         "Terrain tiles, heights, meshes and analyses of the datasets of one daemon. Resources "
         "that "
         "take GET also take HEAD and OPTIONS. Heights are metres. No request names a file of the "
         "server."},
        {"license", {{"name", "GPL-3.0-or-later"}, {"identifier", "GPL-3.0-or-later"}}}}},
      {"servers", {{{"url", "/"}, {"description", "this daemon"}}}},
      {"tags", Ordered::array()}};
  for (const Tag& tag : kTags)
    head["tags"].push_back({{"name", tag.name}, {"description", tag.about}});
  return head;
}

Ordered openapi_components() {
  Ordered responses = Ordered::object();
  const Ordered problem = {{"application/problem+json", {{"schema", Ordered::parse(kProblemRef)}}},
                           {"text/html", {{"schema", {{"type", "string"}}}}}};
  for (const Refused& one : kRefused)
    responses[one.status] = {{"description", one.about}, {"content", problem}};
  const Ordered text = {{"schema", {{"type", "string"}}}};
  for (const char* const limited : {"429", "503"})
    responses[limited]["headers"]["Retry-After"] = {{"description", "seconds"},
                                                    {"schema", {{"type", "integer"}}}};
  responses["401"]["headers"]["WWW-Authenticate"] = text;
  for (const char* const field : {"RateLimit", "RateLimit-Policy"})
    responses["429"]["headers"][field] = text;
  return {{"schemas",
           {{"Problem", Ordered::parse(kProblem)},
            {"Job", Ordered::parse(kJob)},
            {"Link", Ordered::parse(kLink)},
            {"GeoJson", Ordered::parse(kGeoJson)}}},
          {"responses", std::move(responses)},
          {"securitySchemes",
           {{"bearer", {{"type", "http"}, {"scheme", "bearer"}}},
            {"header", {{"type", "apiKey"}, {"in", "header"}, {"name", "X-API-Key"}}},
            {"query", {{"type", "apiKey"}, {"in", "query"}, {"name", "key"}}}}}};
}

}  // namespace tind::api
