// /elevation/{dataset}: the height of a place (GET), or of many (POST), from the DEM or as a client
// of a level of tiles sees it.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "server/api/accuracy_json.h"
#include "server/api/app.h"
#include "server/api/elevation/heights.h"
#include "server/api/elevation/lookups.h"
#include "server/api/elevation/places.h"
#include "server/api/members.h"
#include "server/api/openapi/openapi_parts.h"
#include "server/api/responses.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"
#include "terrain/geo/longitude.h"
#include "terrain/raster/crs_points.h"

namespace tind::api {
namespace {

constexpr std::size_t kMostBody = 8u << 20;
/// Longer ones are a batch, which keeps no question waiting.
constexpr std::size_t kQuickly = 10'000;  // bytes

/// "2600000,1200000"
std::optional<Vec2> pair_of(std::string_view text) {
  Vec2 p;
  const char* const end = text.data() + text.size();
  const auto x = std::from_chars(text.data(), end, p.x);
  if (x.ec != std::errc() || x.ptr == end || *x.ptr != ',') return {};
  const auto y = std::from_chars(x.ptr + 1, end, p.y);
  if (y.ec != std::errc() || y.ptr != end || !std::isfinite(p.x) || !std::isfinite(p.y)) return {};
  return p;
}

bool is_pair(std::string_view text) { return pair_of(text).has_value(); }

/// What both kinds of request say in their query: crs, and which heights.
std::vector<http::QueryWord> words_with_crs() {
  std::vector<http::QueryWord> words = {{"crs",
                                         {"CRS84"},
                                         is_epsg_code,
                                         "EPSG:CODE",
                                         "of the coordinates; the order is that of its axes",
                                         "^EPSG:[1-9][0-9]{3,4}$"}};
  for (const http::QueryWord& word : height_words()) words.push_back(word);
  return words;
}

/// Where places are that were written down in some CRS; the axes of that.
struct Located {
  std::vector<Geographic> where;
  std::vector<std::string> axes;
  std::string wrong;  // with the CRS; empty: nothing
};

bool on_earth(const Geographic& p) { return std::abs(p.lon) <= 360 && std::abs(p.lat) <= 90; }

/// CRS84: longitude and latitude.
bool is_degrees(const std::string& crs) { return crs.empty() || crs == "CRS84"; }

/// A place that there is not becomes NaN.
Located locate(const services::ServedDataset& dataset, const std::string& crs,
               std::span<const Vec2> points, bool east_first) {
  Located out;
  if (is_degrees(crs)) {
    for (const Vec2& p : points) out.where.push_back({p.x, p.y});
    return out;
  }
  const GeoRect box = dataset.facts().box;
  const auto system = CrsPoints::make(
      crs, within_first_turn({(box.west + box.east) / 2, (box.south + box.north) / 2}));
  if (!system) {
    out.wrong = system.error().what;
    return out;
  }
  std::vector<Vec2> as_axes(points.begin(), points.end());
  if (east_first && !(*system)->east_first())
    for (Vec2& p : as_axes) std::swap(p.x, p.y);
  out.where.resize(points.size());
  (*system)->to_geographic(as_axes, out.where);
  out.axes = {(*system)->axes()[0], (*system)->axes()[1]};
  return out;
}

/// GET: one place.
struct Asked {
  Vec2 point;
  std::string crs;
  HeightQuestion question;
};

/// Of the layer that answers; of tiles, what they say of all.
nlohmann::ordered_json accuracy_of(const services::ServedDataset& dataset, const PlaceHeight& found,
                                   bool of_tiles) {
  if (found.height.coverage != Coverage::value) return nullptr;
  if (of_tiles) {
    const auto stated = dataset.tiles->layer().accuracy;
    return stated.empty() ? nlohmann::ordered_json() : accuracies_json(stated);
  }
  const auto& accuracy = dataset.source->layers()[found.layer].source->info().accuracy;
  return accuracy ? accuracy_json(*accuracy) : nlohmann::ordered_json();
}

nlohmann::ordered_json one_height(const services::ServedDataset& dataset, const Asked& asked,
                                  const Located& located, const Heights& heights) {
  const PlaceHeight& found = heights.places[0];
  nlohmann::ordered_json json = {{"coverage", word(found.height.coverage)}};
  json["height_m"] = height_json(found.height);
  json["datum"] = heights.datum;
  const SurfaceLayer* const layer =
      asked.question.level ? nullptr : &dataset.source->layers()[found.layer];
  if (auto accuracy = accuracy_of(dataset, found, !layer); !accuracy.is_null())
    json["accuracy"] = std::move(accuracy);
  json["source"] = dataset.name;
  if (layer && !dataset.source->only() && found.height.coverage == Coverage::value) {
    const DemInfo& info = layer->source->info();
    json["layer"] = layer->name;
    json["spacing_m"] = {info.spacing_x_m, info.spacing_y_m};
  }
  if (asked.question.interpolation != Interpolation::bilinear)
    json["interpolation"] = name_of(asked.question.interpolation);
  if (found.tile) json["tile"] = found.tile->text();
  if (found.max_error_m) json["max_error_m"] = *found.max_error_m;
  if (const auto between = height_between(found)) {
    json["low_m"] = between->first;
    json["high_m"] = between->second;
  }
  json["lon"] = located.where[0].lon;
  json["lat"] = located.where[0].lat;
  if (!located.axes.empty()) {
    json["crs"] = asked.crs;
    json["coords"] = {asked.point.x, asked.point.y};
    json["axes"] = located.axes;
  }
  return json;
}

http::Reply answer_one(const App& app, const services::ServedDataset& dataset, const Asked& asked,
                       const std::string& target, const std::stop_token& stop) {
  const Located located = locate(dataset, asked.crs, {&asked.point, 1}, false);
  if (!located.wrong.empty()) return http::problem_reply({{"crs", located.wrong}}, target);
  if (!on_earth(located.where[0]))
    return http::problem_reply({{"coords", "are no place of " + asked.crs}}, target);
  const auto heights = heights_of(app, dataset, located.where, asked.question, target, stop);
  if (!heights) return heights.error();
  const nlohmann::ordered_json json = one_height(dataset, asked, located, *heights);
  return http::make_reply(200, "application/json", json.dump() + "\n",
                          {{"Cache-Control", "no-cache"}});
}

std::optional<http::Reply> get_elevation(const App& app, const http::Request& request,
                                         http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  auto query = http::read_query(request);
  const std::string &crs = query.words[0], &coords = query.words.back();
  if (query.problems.empty() && coords.empty() && !crs.empty() && crs != "CRS84")
    query.problems.push_back({"coords", "missing: two numbers of " + crs});
  else if (query.problems.empty() && coords.empty())
    for (std::size_t k = 0; k < 2; ++k)
      if (!query.values[k])
        query.problems.push_back({k == 0 ? "lon" : "lat", "missing: decimal degrees"});
  if (!coords.empty() && (query.values[0] || query.values[1]))
    query.problems.push_back({"coords", "and lon, lat name two places"});
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);

  Asked asked{{}, crs, height_question(std::span(query.words).subspan(1))};
  asked.point = coords.empty() ? Vec2{*query.values[0], *query.values[1]} : *pair_of(coords);
  if (auto none = no_such_heights(*dataset, asked.question, request)) return none;
  const auto work = asked.question.level ? services::Work::tile : services::Work::question;
  return answer_on_worker(
      app, work, request, deferred,
      [&app, dataset, asked = std::move(asked), target = std::string(request.head.target)](
          const std::stop_token& stop) { return answer_one(app, *dataset, asked, target, stop); });
}

/// POST: many places.
struct AskedMany {
  std::string crs, type;
  HeightQuestion question;
};

http::Reply answer_many(const App& app, const services::ServedDataset& dataset,
                        const AskedMany& asked, std::string_view body, const std::string& target,
                        const std::stop_token& stop) {
  const auto document = PlacesDocument::read(asked.type, body, asked.crs, target, stop);
  if (!document) return document.error();
  PlacesDocument& places = **document;
  const Located located = locate(dataset, asked.crs, places.coordinates(), places.east_first());
  if (!located.wrong.empty()) return http::problem_reply({{"crs", located.wrong}}, target);
  Problems problems;
  for (std::size_t i = 0; i < located.where.size(); ++i)
    if (!on_earth(located.where[i]))
      problems.add(places.name_of(i), asked.crs.empty() ? "must be longitude and latitude, degrees"
                                                        : "is no place of " + asked.crs);
  if (!problems.empty()) return http::problem_reply(problems.list(), target);
  const auto heights = heights_of(app, dataset, located.where, asked.question, target, stop);
  if (!heights) return heights.error();
  return http::make_reply(200, places.media_type(),
                          places.with_heights({dataset, asked.question, *heights}),
                          {{"Cache-Control", "no-store"}});
}

/// A table has a place a line below the first; numbers of JSON have commas between.
std::size_t places_at_most(std::string_view type, std::string_view body) {
  const auto count = [body](char c) { return std::size_t(std::ranges::count(body, c)); };
  if (type == "text/csv") return count('\n') - std::size_t(body.ends_with('\n'));
  return (count(',') + 1) / 2;
}

std::optional<http::Reply> post_elevation(const App& app, const http::Request& request,
                                          http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto query = http::read_query(request);
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  AskedMany asked{query.words[0],
                  http::media_type(request.head.fields.find("content-type").value_or("")),
                  height_question(std::span(query.words).subspan(1))};
  if (auto none = no_such_heights(*dataset, asked.question, request)) return none;
  const bool quick = !asked.question.level && request.body.size() < kQuickly;
  const services::Work work =
      quick ? work_of(*dataset, places_at_most(asked.type, request.body)) : services::Work::batch;
  // The body stays until the answer is sent.
  return answer_on_worker(app, work, request, deferred,
                          [&app, dataset, asked = std::move(asked), body = request.body,
                           target = std::string(request.head.target)](const std::stop_token& stop) {
                            return answer_many(app, *dataset, asked, body, target, stop);
                          });
}

constexpr const char* kOneHeight = R"({
  "type": "object",
  "required": ["coverage", "height_m", "datum", "source", "lon", "lat"],
  "properties": {
    "coverage": {"enum": ["value", "void", "outside"]},
    "height_m": {"type": ["number", "null"], "description": "null unless coverage is value"},
    "datum": {"type": "string", "description": "what the height is above"},
    "accuracy": {"type": "object", "description": "as who made the heights says"},
    "source": {"type": "string", "description": "the dataset"},
    "layer": {"type": "string"},
    "spacing_m": {"type": "array", "items": {"type": "number"}},
    "interpolation": {"type": "string"},
    "tile": {"type": "string", "description": "whose mesh it is"},
    "max_error_m": {"type": "number", "description": "no post of it is farther from the mesh"},
    "low_m": {"type": "number", "description": "with high_m: the DEM's height is between them"},
    "high_m": {"type": "number"},
    "lon": {"type": "number"}, "lat": {"type": "number"},
    "crs": {"type": "string"},
    "coords": {"type": "array", "items": {"type": "number"}},
    "axes": {"type": "array", "items": {"type": "string"}}
  }})";

http::Operation get_operation() {
  http::Operation operation = {
      .id = "getElevation",
      .tag = "Heights",
      .summary = "The height at a place",
      .about = "Of `lon` and `lat`, or of `coords` in `crs`.",
      .numbers = {{"lon", -360, 360, "decimal degrees", false, {}, "-121.76"},
                  {"lat", -90, 90, "decimal degrees", false, {}, "46.85"}},
      .words = words_with_crs(),
      .responses = json_answer("The height, or why there is none.", kOneHeight)};
  operation.words.push_back({.name = "coords",
                             .words = {},
                             .fits = is_pair,
                             .form = "two numbers with a comma between",
                             .about = "the place in place of lon and lat, in crs",
                             .pattern = "^-?[0-9]{1,7}(\\.[0-9]{1,6})?,-?[0-9]{1,7}$"});
  return operation;
}

constexpr const char* kLocations = R"({
  "type": "object",
  "required": ["locations"],
  "additionalProperties": false,
  "properties": {
    "locations": {
      "type": "array", "minItems": 1, "maxItems": 100000,
      "items": {"type": "array", "items": {"type": "number", "minimum": -90, "maximum": 90},
                "minItems": 2, "maxItems": 2}
    }
  }})";

constexpr const char* kHeightsOfLocations = R"({
  "type": "object",
  "required": ["height_m", "coverage"],
  "properties": {
    "source": {"type": "string"}, "datum": {"type": "string"}, "surface": {"type": "string"},
    "interpolation": {"type": "string"}, "accuracy": {"type": "object"},
    "height_m": {"type": "array", "items": {"type": ["number", "null"]}},
    "coverage": {"type": "array", "items": {"enum": ["value", "void", "outside"]}},
    "tile": {"type": "array"}, "max_error_m": {"type": "array"}, "layer": {"type": "array"},
    "low_m": {"type": "array", "items": {"type": ["number", "null"]}},
    "high_m": {"type": "array", "items": {"type": ["number", "null"]}}
  }})";

http::Operation post_operation() {
  return {.id = "getElevations",
          .tag = "Heights",
          .summary = "The heights at many places",
          .about = "At most 100,000. The answer has the form of the request.",
          .words = words_with_crs(),
          .body = {{"application/json", kLocations,
                    R"({"locations": [[-121.76, 46.85], [-121.7, 46.8]]})"},
                   {"application/geo+json", kGeoJsonRef,
                    R"({"type": "LineString", "coordinates": [[-121.76, 46.85], [-121.7, 46.8]]})"},
                   {"text/csv", R"({"type": "string"})", R"("lon,lat\n-121.76,46.85\n")"}},
          .responses = {{200,
                         "The heights, in the same order.",
                         {{"application/json", kHeightsOfLocations},
                          {"application/geo+json", kGeoJsonRef},
                          {"text/csv", R"({"type": "string"})"}}}}};
}

}  // namespace

void add_elevation_routes(http::Router& router, const App& app) {
  const std::string path = "/elevation/{dataset}";
  router.get(path, get_operation(),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return get_elevation(app, request, deferred);
             });
  http::BodyRules rules = json_for_dataset(app, kMostBody);
  rules.type = kPlacesTypes;
  router.post(path, post_operation(), rules,
              [&app](const http::Request& request, http::DeferredReply& deferred) {
                return post_elevation(app, request, deferred);
              });
}

}  // namespace tind::api
