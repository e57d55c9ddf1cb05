// Heights at the addresses of Open Topo Data (/v1/{dataset}) and of Google's Elevation API
// (/maps/api/elevation/json): their clients need another host name and nothing else.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "server/api/elevation/lookups.h"
#include "server/api/elevation/places.h"
#include "server/api/openapi/openapi_parts.h"
#include "server/http/message/uri.h"
#include "terrain/geo/geodesic_path.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using Parameters = std::map<std::string, std::string, std::less<>>;

constexpr std::size_t kMostBody = 8u << 20;

/// Refused as both services do it.
http::Reply refused(const char* member, const std::string& why, int status = 400) {
  const Ordered json = {{member, why}, {"status", "INVALID_REQUEST"}};
  return http::make_reply(status, "application/json", json::to_text(json) + "\n",
                          {{"Cache-Control", "no-store"}});
}

std::expected<Parameters, Refusal> of_query(std::string_view query) {
  const auto read = http::parse_query(query);
  if (!read) return std::unexpected(std::string("the query ") + http::kBadQuery);
  Parameters parameters;
  for (const auto& [name, value] : *read) parameters[name] = value;
  return parameters;
}

/// A POST has the same parameters as a JSON object, or as a form. Many clients send JSON and call
/// it a form: curl does.
std::expected<Parameters, Refusal> of_body(std::string_view body) {
  const auto first = body.find_first_not_of(" \t\r\n");
  if (first == body.npos || (body[first] != '{' && body[first] != '[')) return of_query(body);
  if (json::count_values(body) > http::kMostParameters)  // places are one text
    return std::unexpected(
        fmt::format("the body has more than {} JSON values", http::kMostParameters));
  const auto json = json::parse<nlohmann::json>(body);
  if (!json.is_object()) return std::unexpected("the body is no JSON object");
  Parameters parameters;
  for (const auto& [name, value] : json.items()) {
    if (value.is_string())
      parameters[name] = value.get<std::string>();
    else if (value.is_number() || value.is_null())
      parameters[name] = json::to_text(value);
    else
      return std::unexpected(name + " must be text or a number");
  }
  return parameters;
}

struct Asked {
  std::vector<Geographic> places;
  Interpolation interpolation = Interpolation::bilinear;
  Ordered none = nullptr;  // what stands for no height
  bool geojson = false;
};

std::string_view value_of(const Parameters& parameters, std::string_view name) {
  const auto found = parameters.find(name);
  return found == parameters.end() ? std::string_view() : std::string_view(found->second);
}

std::optional<std::size_t> samples_of(std::string_view text) {
  std::size_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  if (count < 2 || count > kMostPlaces) return {};
  return count;
}

/// The places, or so many along the way through them.
std::expected<std::vector<Geographic>, Refusal> places_asked(const Parameters& parameters,
                                                             std::string_view way) {
  auto places = places_of_text(value_of(parameters, way));
  const std::string_view samples = value_of(parameters, "samples");
  if (!places || samples.empty()) return places;
  const auto count = samples_of(samples);
  if (!count)
    return std::unexpected(fmt::format("samples must be a whole number from 2 to {}", kMostPlaces));
  return GeodesicPath(*places).evenly(*count);
}

std::expected<Asked, Refusal> read_asked(const Parameters& parameters) {
  Asked asked;
  auto places = places_asked(parameters, "locations");
  if (!places) return std::unexpected(places.error());
  asked.places = std::move(*places);
  if (const std::string_view text = value_of(parameters, "interpolation"); !text.empty()) {
    const auto chosen = enum_named<Interpolation>(text);
    if (!chosen) return std::unexpected("interpolation must be nearest, bilinear or cubic");
    asked.interpolation = *chosen;
  }
  if (const std::string_view text = value_of(parameters, "nodata_value");
      !text.empty() && text != "null") {
    const auto json = json::parse<Ordered>(text);
    if (!json.is_number())
      return std::unexpected("nodata_value must be null or a number, as JSON has them");
    asked.none = json;
  }
  if (const std::string_view text = value_of(parameters, "format"); !text.empty()) {
    if (text != "json" && text != "geojson")
      return std::unexpected("format must be json or geojson");
    asked.geojson = text == "geojson";
  }
  return asked;
}

std::string answer_of(const Asked& asked, std::span<const LookedUp> found) {
  Ordered list = Ordered::array();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Geographic& p = asked.places[i];
    const Ordered height = found[i].height_m ? Ordered(*found[i].height_m) : asked.none;
    const std::string& name = found[i].dataset->name;
    if (asked.geojson)
      list.push_back(
          {{"type", "Feature"},
           {"geometry",
            {{"type", "Point"}, {"coordinates", Ordered::array({p.lon, p.lat, height})}}},
           {"properties", {{"dataset", name}}}});
    else
      list.push_back({{"elevation", height},
                      {"location", {{"lat", p.lat}, {"lng", p.lon}}},
                      {"dataset", name}});
  }
  if (asked.geojson)
    return json::to_text(Ordered{{"type", "FeatureCollection"}, {"features", std::move(list)}});
  return json::to_text(Ordered{{"results", std::move(list)}, {"status", "OK"}});
}

http::Reply answer(const App& app, const Datasets& datasets,
                   const std::expected<Parameters, Refusal>& parameters, const std::string& target,
                   const std::stop_token& stop) {
  if (!parameters) return refused("error", parameters.error());
  const auto asked = read_asked(*parameters);
  if (!asked) return refused("error", asked.error());
  const auto found = look_up(app, datasets, asked->places, asked->interpolation, target, stop);
  if (!found) return found.error();
  return http::make_reply(200, asked->geojson ? "application/geo+json" : "application/json",
                          answer_of(*asked, *found) + "\n", {{"Cache-Control", "no-cache"}});
}

/// Google's: no dataset in the address, and each answer with its resolution.
http::Reply answer_as_google(const App& app, const Datasets& datasets, const std::string& query,
                             const std::string& target, const std::stop_token& stop) {
  const auto parameters = of_query(query);
  if (!parameters) return refused("error_message", parameters.error());
  const bool way = parameters->contains("path");
  if (way == parameters->contains("locations"))
    return refused("error_message", "give either locations, or path and samples");
  if (way && !parameters->contains("samples"))
    return refused("error_message", "a path needs samples: how many heights along it");
  if (!way && parameters->contains("samples"))
    return refused("error_message", "samples are of a path");
  const auto places = places_asked(*parameters, way ? "path" : "locations");
  if (!places) return refused("error_message", places.error());
  const auto found = look_up(app, datasets, *places, Interpolation::bilinear, target, stop);
  if (!found) return found.error();
  Ordered results = Ordered::array();
  for (std::size_t i = 0; i < found->size(); ++i) {
    const LookedUp& one = (*found)[i];
    Ordered result = {{"elevation", nullptr},
                      {"location", {{"lat", (*places)[i].lat}, {"lng", (*places)[i].lon}}}};
    if (one.height_m) {
      const DemInfo& info = one.dataset->source->info();
      result["elevation"] = *one.height_m;
      result["resolution"] = std::max(info.spacing_x_m, info.spacing_y_m);
    }
    results.push_back(std::move(result));
  }
  const Ordered json = {{"results", std::move(results)}, {"status", "OK"}};
  return http::make_reply(200, "application/json", json::to_text(json) + "\n",
                          {{"Cache-Control", "no-cache"}});
}

constexpr const char* kAnswer = R"({
  "type": "object",
  "required": ["results", "status"],
  "properties": {"results": {"type": "array", "items": {"type": "object"}},
                 "status": {"const": "OK"}}})";
constexpr const char* kRefusal = R"({
  "type": "object",
  "required": ["status"],
  "properties": {"status": {"type": "string"}, "error": {"type": "string"},
                 "error_message": {"type": "string"}}})";

/// The parameters of Open Topo Data as a query has them.
std::vector<http::QueryWord> topo_words() {
  return {locations_word(),
          {.name = "samples",
           .words = {},
           .form = "a whole number from 2 to 100000",
           .about = "so many places along the way through the locations",
           .pattern = "^[2-9][0-9]{0,3}$",
           .example = "10"},
          {.name = "interpolation", .words = {"nearest", "bilinear", "cubic"}},
          {.name = "nodata_value",
           .words = {"null"},
           .form = "a number",
           .about = "what stands for no height",
           .pattern = "^-?[1-9][0-9]{0,4}$",
           .example = "-9999"},
          {.name = "format", .words = {"json", "geojson"}}};
}

constexpr const char* kTopoBody = R"({
  "type": "object",
  "required": ["locations"],
  "properties": {
    "locations": {"type": "string"},
    "samples": {"type": "integer", "minimum": 2, "maximum": 100000},
    "interpolation": {"enum": ["nearest", "bilinear", "cubic"]},
    "nodata_value": {"type": ["number", "null"]},
    "format": {"enum": ["json", "geojson"]}
  }})";

http::Operation topo_operation(bool post) {
  http::Operation made = {
      .id = post ? "postOpenTopoData" : "getOpenTopoData",
      .tag = "Heights as other services",
      .summary = "Heights as Open Topo Data gives them",
      .words = post ? std::vector<http::QueryWord>{} : topo_words(),
      .ignores_others = true,
      .path = {{"dataset", "the name of a dataset, or several with commas between",
                R"({"type": "string"})", R"("alps")"}},
      .responses = {{200,
                     "The heights, in the same order.",
                     {{"application/json", kAnswer}, {"application/geo+json", kGeoJsonRef}}},
                    {400, "The request is wrong.", {{"application/json", kRefusal}}},
                    {404, "There is no such dataset.", {{"application/json", kRefusal}}}}};
  if (post)
    made.body = {{"application/json", kTopoBody, R"({"locations": "46.85,-121.76"})"},
                 {"application/x-www-form-urlencoded", kTopoBody}};
  return made;
}

http::Operation google_operation() {
  std::vector<http::QueryWord> words = {locations_word()};
  words.push_back({.name = "path",
                   .words = {},
                   .form = "as locations",
                   .about = "in place of locations: a way, with samples",
                   .pattern = words[0].pattern});
  words.push_back(topo_words()[1]);
  words.back().example = {};
  return {.id = "getGoogleElevation",
          .tag = "Heights as other services",
          .summary = "Heights as Google's Elevation API gives them",
          .about = "Of all datasets, the finest first.",
          .heeds_access = true,
          .words = std::move(words),
          .ignores_others = true,
          .responses = {{200, "The heights, in the same order.", {{"application/json", kAnswer}}},
                        {400, "The request is wrong.", {{"application/json", kRefusal}}}}};
}

}  // namespace

void add_open_topo_data_routes(http::Router& router, const App& app) {
  const std::string path = "/v1/{dataset}";
  const auto named = [&app](const http::Request& request) {
    return datasets_named(app, request, request.matched[0]);
  };
  router.get(path, topo_operation(false),
             [&app, named](const http::Request& request,
                           http::DeferredReply& deferred) -> std::optional<http::Reply> {
               auto datasets = named(request);
               if (!datasets) return refused("error", datasets.error(), 404);
               return answer_on_worker(
                   app, work_of(request.head.query), request, deferred,
                   [&app, datasets = std::move(*datasets), query = std::string(request.head.query),
                    target = std::string(request.head.target)](const std::stop_token& stop) {
                     return answer(app, datasets, of_query(query), target, stop);
                   });
             });
  http::BodyRules rules{.max_bytes = kMostBody, .type = ""};  // as a GET, it only answers
  rules.refuse = [named](const http::Request& request) -> std::optional<http::Reply> {
    if (auto found = named(request); !found) return refused("error", found.error(), 404);
    return std::nullopt;
  };
  router.post(path, topo_operation(true), rules,
              [&app, named](const http::Request& request,
                            http::DeferredReply& deferred) -> std::optional<http::Reply> {
                auto datasets = named(request);
                if (!datasets) return refused("error", datasets.error(), 404);
                return answer_on_worker(
                    app, work_of(request.body), request, deferred,
                    [&app, datasets = std::move(*datasets), body = request.body,
                     target = std::string(request.head.target)](const std::stop_token& stop) {
                      return answer(app, datasets, of_body(body), target, stop);
                    });
              });
  router.get("/maps/api/elevation/json", google_operation(),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return answer_on_worker(
                   app, work_of(request.head.query), request, deferred,
                   [&app, datasets = all_finest_first(app, request),
                    query = std::string(request.head.query),
                    target = std::string(request.head.target)](const std::stop_token& stop) {
                     return answer_as_google(app, datasets, query, target, stop);
                   });
             });
}

}  // namespace tind::api
