// / and /conformance (OGC API - Common, Part 1, 19-072). A browser gets the viewer at /, and the
// landing page as a page at /?f=html.

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/ogc/document.h"
#include "server/api/ogc/routes.h"
#include "server/http/message/problem.h"
#include "server/http/message/representation.h"
#include "server/http/message/uri.h"

namespace tind::api::ogc {
namespace {

constexpr const char* kOpenApi = "application/vnd.oai.openapi+json;version=3.1";

Ordered landing_json(const App& app, const Asked& asked) {
  Ordered json = {
      {"title", "tind"},
      {"description",
       "Terrain of this server: tiles, heights and coverages, and work on them, by OGC API."}};
  Ordered links = Ordered::array(
      {link(asked, "/openapi.json", "service-desc", kOpenApi, "every operation (OpenAPI)"),
       link(asked, "/conformance", kRelConformance, kJson, "what this server conforms to"),
       link(asked, "/collections", "data", kJson, "the datasets"),
       link(asked, "/tileMatrixSets", kRelTilingSchemes, kJson, "how tiles are cut")});
  if (app.jobs) {
    links.push_back(link(asked, "/processes", kRelProcesses, kJson, "what can be done with them"));
    links.push_back(link(asked, "/jobs", kRelJobs, kJson, "your jobs"));
  }
  if (app.viewer.size() > 0)
    links.push_back(link(asked, "/viewer/", "related", kHtml, "the viewer, a globe"));
  json["links"] = std::move(links);
  return json;
}

std::string spec(const char* standard, const char* part) {
  return "http://www.opengis.net/spec/" + std::string(standard) + "/conf/" + part;
}

Ordered classes(bool processes) {
  struct Standard {
    const char* name;
    std::vector<const char*> parts;
  };
  std::vector<Standard> all = {
      {"ogcapi-common-1/1.0", {"core", "landing-page", "json", "html"}},
      {"ogcapi-common-2/1.0", {"collections", "json", "html"}},
      {"tms/2.0",
       {"tilematrixset", "json-tilematrixset", "tilesetmetadata", "json-tilesetmetadata"}},
      {"ogcapi-tiles-1/1.0", {"core", "tileset", "tilesets-list", "geodata-tilesets", "png"}},
      {"ogcapi-edr-1/1.1",
       {"core", "collections", "queries", "json", "geojson", "covjson", "html"}}};
  if (processes)
    all.push_back({"ogcapi-processes-1/1.0",
                   {"core", "ogc-process-description", "json", "job-list", "dismiss"}});
  Ordered list = Ordered::array();
  for (const Standard& standard : all)
    for (const char* part : standard.parts) list.push_back(spec(standard.name, part));
  return list;
}

/// Asked for as a page, and not by `f`. All else in the query is the viewer's: its links say which
/// dataset they show.
bool is_for_viewer(const http::Request& request) {
  if (form_of({}, request.head.fields) != Form::html) return false;
  const auto query = http::parse_query(request.head.query);
  return query && std::ranges::find(*query, "f", &http::Parameter::name) == query->end();
}

std::optional<http::Reply> landing(const App& app, const http::Representation* viewer,
                                   const http::Request& request) {
  if (viewer && is_for_viewer(request)) return viewer->reply(request.head.fields);
  const auto asked = read_asked(request);
  if (!asked) return asked.error();
  return document_reply(*asked, landing_json(app, *asked));
}

constexpr const char* kLanding = R"({
  "type": "object",
  "required": ["links"],
  "properties": {"title": {"type": "string"}, "description": {"type": "string"},
                 "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";
constexpr const char* kConformance = R"({
  "type": "object",
  "required": ["conformsTo"],
  "properties": {"title": {"type": "string"},
                 "conformsTo": {"type": "array", "items": {"type": "string"}},
                 "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";

/// For everybody: it says where the document is that says how keys are shown.
http::Operation open_operation(const char* id, const char* summary, const char* schema) {
  http::Operation operation = document_operation(id, summary, schema);
  operation.scope = http::Scope::open;
  return operation;
}

}  // namespace

void add_landing_routes(http::Router& router, const App& app) {
  // The viewer's page, as one of two forms of this address.
  std::shared_ptr<const http::Representation> viewer;
  if (const auto page = app.viewer.find("index.html"))
    viewer = http::Representation::make(page->body(), {.content_type = "text/html; charset=utf-8",
                                                       .vary = "Accept, Accept-Encoding"});
  router.get(
      "/", open_operation("getLandingPage", "The landing page; for browsers the viewer", kLanding),
      [&app, viewer](const http::Request& request, http::DeferredReply&) {
        return landing(app, viewer.get(), request);
      });
  router.get(
      "/conformance",
      open_operation("getConformance", "What this server conforms to", kConformance),
      [&app](const http::Request& request, http::DeferredReply&) -> std::optional<http::Reply> {
        const auto asked = read_asked(request);
        if (!asked) return asked.error();
        return document_reply(
            *asked, {{"title", "Conformance"}, {"conformsTo", classes(app.jobs != nullptr)}});
      });
}

}  // namespace tind::api::ogc
