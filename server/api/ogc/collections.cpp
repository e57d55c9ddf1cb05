// /collections and /collections/{id} (OGC API - Common, Part 2, 20-024): the datasets.

#include <nlohmann/json.hpp>
#include <utility>

#include "server/api/ogc/collection_json.h"
#include "server/api/ogc/document.h"
#include "server/api/ogc/routes.h"

namespace tind::api::ogc {
namespace {

/// With the link to itself that each entry of the list has.
Result<Ordered> entry_json(const Asked& asked, const services::ServedDataset& dataset) {
  auto made = collection_json(asked, dataset, false);
  if (!made) return made;
  Ordered& json = *made;
  const std::string self = "/collections/" + dataset.name;
  Ordered links =
      Ordered::array({link(asked, self, "self", kJson, "this dataset"),
                      link(asked, self + "?f=html", "alternate", kHtml, "this dataset as a page")});
  for (const Ordered& one : json["links"]) links.push_back(one);
  json["links"] = std::move(links);
  return made;
}

std::optional<http::Reply> list(const App& app, const http::Request& request,
                                http::DeferredReply& deferred) {
  auto asked = read_asked(request);
  if (!asked) return asked.error();
  return answer_on_worker(
      app, services::Work::question, request, deferred,
      [&app, access = request.access, asked = std::move(*asked)](const std::stop_token&) {
        Ordered all = Ordered::array();
        for (const auto& dataset : app.catalog.all()) {
          if (access && !access->sees(dataset->name)) continue;
          auto entry = entry_json(asked, *dataset);
          if (!entry) return http::problem_reply(entry.error(), asked.target);
          all.push_back(std::move(*entry));
        }
        return document_reply(asked, {{"title", "Datasets"}, {"collections", std::move(all)}});
      });
}

std::optional<http::Reply> one(const App& app, const http::Request& request,
                               http::DeferredReply& deferred) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  auto asked = read_asked(request);
  if (!asked) return asked.error();
  return answer_on_worker(app, services::Work::question, request, deferred,
                          [dataset, asked = std::move(*asked)](const std::stop_token&) {
                            auto json = collection_json(asked, *dataset, true);
                            if (!json) return http::problem_reply(json.error(), asked.target);
                            return document_reply(asked, std::move(*json));
                          });
}

constexpr const char* kCollections = R"({
  "type": "object",
  "required": ["collections", "links"],
  "properties": {"title": {"type": "string"},
                 "collections": {"type": "array", "items": {"type": "object"}},
                 "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";
constexpr const char* kCollection = R"({
  "type": "object",
  "required": ["id", "extent", "links"],
  "properties": {
    "id": {"type": "string"}, "title": {"type": "string"}, "description": {"type": "string"},
    "attribution": {"type": "string"}, "keywords": {"type": "array"},
    "extent": {"type": "object"}, "crs": {"type": "array"}, "storageCrs": {"type": "string"},
    "dataType": {"type": "string"}, "output_formats": {"type": "array"},
    "parameter_names": {"type": "object"}, "data_queries": {"type": "object"},
    "domainSet": {"type": "object"}, "rangeType": {"type": "object"},
    "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";

}  // namespace

void add_collection_routes(http::Router& router, const App& app) {
  router.get("/collections", document_operation("getCollections", "The datasets", kCollections),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return list(app, request, deferred);
             });
  router.get("/collections/{collectionId}",
             document_operation("getCollection", "A dataset", kCollection),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return one(app, request, deferred);
             });
}

}  // namespace tind::api::ogc
