// Heights at the address of Open-Elevation: /api/v1/lookup.

#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "server/api/elevation/lookups.h"
#include "server/http/message/uri.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr std::size_t kMostBody = 8u << 20;

http::Reply refused(const std::string& why) {
  return http::make_reply(400, "application/json", json::to_text(Ordered{{"error", why}}) + "\n",
                          {{"Cache-Control", "no-store"}});
}

/// What a query says: the places of a GET; which datasets, of both.
struct Query {
  std::string locations, datasets;
};

std::expected<Query, Refusal> read_query(std::string_view text) {
  const auto read = http::parse_query(text);
  if (!read) return std::unexpected(std::string("the query ") + http::kBadQuery);
  Query query;
  for (const auto& [name, value] : *read) {
    if (name == "locations") query.locations = value;
    if (name == "dataset") query.datasets = value;
  }
  return query;
}

/// {"locations": [{"latitude": 46.85, "longitude": -121.76}]}
std::expected<std::vector<Geographic>, Refusal> places_of_body(std::string_view body) {
  const auto json = read_json(body);
  if (!json) return std::unexpected("the body: " + json.error());
  if (!json->is_object() || !json->contains("locations"))
    return std::unexpected(
        "the body must be {\"locations\": [{\"latitude\": ..., \"longitude\": ...}]}");
  return places_of_list((*json)["locations"], "locations", "latitude", "longitude");
}

http::Reply answer(const App& app, const Datasets& datasets,
                   const std::expected<std::vector<Geographic>, Refusal>& places,
                   const std::string& target, const std::stop_token& stop) {
  if (!places) return refused(places.error());
  const auto found = look_up(app, datasets, *places, Interpolation::bilinear, target, stop);
  if (!found) return found.error();
  Ordered results = Ordered::array();
  for (std::size_t i = 0; i < found->size(); ++i) {
    const auto& height = (*found)[i].height_m;
    results.push_back({{"latitude", (*places)[i].lat},
                       {"longitude", (*places)[i].lon},
                       {"elevation", height ? Ordered(*height) : Ordered(nullptr)}});
  }
  return http::make_reply(200, "application/json",
                          json::to_text(Ordered{{"results", std::move(results)}}) + "\n",
                          {{"Cache-Control", "no-cache"}});
}

std::optional<http::Reply> answer_later(const App& app, const http::Request& request,
                                        http::DeferredReply& deferred) {
  auto query = read_query(request.head.query);
  if (!query) return refused(query.error());
  auto datasets = datasets_named(app, request, query->datasets);
  if (!datasets) return refused("dataset: " + datasets.error());
  const bool post = request.head.method == http::Method::post;
  return answer_on_worker(
      app, work_of(post ? request.body : request.head.query), request, deferred,
      [&app, post, datasets = std::move(*datasets), query = std::move(*query), body = request.body,
       target = std::string(request.head.target)](const std::stop_token& stop) {
        return answer(app, datasets, post ? places_of_body(body) : places_of_text(query.locations),
                      target, stop);
      });
}

constexpr const char* kAnswer = R"({
  "type": "object",
  "required": ["results"],
  "properties": {"results": {"type": "array", "items": {
    "type": "object",
    "required": ["latitude", "longitude", "elevation"],
    "properties": {"latitude": {"type": "number"}, "longitude": {"type": "number"},
                   "elevation": {"type": ["number", "null"]}}}}}})";
constexpr const char* kRefusal = R"({
  "type": "object", "required": ["error"], "properties": {"error": {"type": "string"}}})";

http::Operation operation(bool post) {
  http::Operation made = {
      .id = post ? "postOpenElevation" : "getOpenElevation",
      .tag = "Heights as other services",
      .summary = "Heights as Open-Elevation gives them",
      .heeds_access = true,
      .words = {{.name = "dataset",
                 .words = {},
                 .form = "names with commas between",
                 .about = "which are asked; all without it, the finest first",
                 .pattern = "^[A-Za-z0-9._-]{1,20}$"}},
      .ignores_others = true,
      .responses = {{200, "The heights, in the same order.", {{"application/json", kAnswer}}},
                    {400, "The request is wrong.", {{"application/json", kRefusal}}}}};
  if (!post) made.words.push_back(locations_word());
  if (post)
    made.body = {{"application/json", R"({
      "type": "object",
      "required": ["locations"],
      "properties": {"locations": {"type": "array", "minItems": 1, "maxItems": 100000, "items": {
        "type": "object",
        "required": ["latitude", "longitude"],
        "properties": {"latitude": {"type": "number", "minimum": -90, "maximum": 90},
                       "longitude": {"type": "number", "minimum": -180, "maximum": 180}}}}}})",
                  R"({"locations": [{"latitude": 46.85, "longitude": -121.76}]})"}};
  return made;
}

}  // namespace

void add_open_elevation_routes(http::Router& router, const App& app) {
  const std::string path = "/api/v1/lookup";
  const auto handler = [&app](const http::Request& request, http::DeferredReply& deferred) {
    return answer_later(app, request, deferred);
  };
  router.get(path, operation(false), handler);
  router.post(path, operation(true), {.max_bytes = kMostBody, .type = ""}, handler);
}

}  // namespace tind::api
