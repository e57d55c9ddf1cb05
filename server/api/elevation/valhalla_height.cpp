// Heights at the address of Valhalla's elevation service: /height, with the request as a body or as
// ?json=.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "server/api/elevation/lookups.h"
#include "server/api/elevation/places.h"
#include "server/http/message/uri.h"
#include "terrain/geo/geodesic_path.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr std::size_t kMostBody = 8u << 20;
constexpr int kMostDecimals = 2;

http::Reply refused(const std::string& why) {
  const Ordered json = {{"error", why}, {"status_code", 400}, {"status", "Bad Request"}};
  return http::make_reply(400, "application/json", json::to_text(json) + "\n",
                          {{"Cache-Control", "no-store"}});
}

struct Asked {
  std::vector<Geographic> places;
  std::vector<double> range_m;  // empty: not asked for
  int decimals = 0;
  Ordered echoed = Ordered::object();  // what the answer repeats
};

std::expected<std::vector<Geographic>, Refusal> read_places(const nlohmann::json& json,
                                                            int& digits) {
  digits = 6;
  if (const auto format = json.find("shape_format"); format != json.end()) {
    if (*format != "polyline6" && *format != "polyline5")
      return std::unexpected("shape_format must be polyline6 or polyline5");
    digits = *format == "polyline5" ? 5 : 6;
  }
  if (const auto shape = json.find("shape"); shape != json.end())
    return places_of_list(*shape, "shape", "lat", "lon");
  const auto polyline = json.find("encoded_polyline");
  if (polyline == json.end() || !polyline->is_string())
    return std::unexpected("there must be a shape or an encoded_polyline");
  return places_of_polyline(polyline->get<std::string>(), digits);
}

/// Places at the given distance from each other along the way, and its end.
std::expected<void, Refusal> resample(Asked& asked, const GeodesicPath& way, double metres) {
  const double steps = way.length_m() / metres;
  if (!(steps < double(kMostPlaces) - 1))
    return std::unexpected("resample_distance makes more than " + std::to_string(kMostPlaces) +
                           " places");
  asked.places.clear(), asked.range_m.clear();
  for (int k = 0; k < steps; ++k) {
    asked.range_m.push_back(k * metres);
    asked.places.push_back(way.at(k * metres));
  }
  asked.range_m.push_back(way.length_m());
  asked.places.push_back(way.at(way.length_m()));
  return {};
}

Ordered shape_of(std::span<const Geographic> places) {
  Ordered shape = Ordered::array();
  for (const Geographic& p : places) shape.push_back({{"lat", p.lat}, {"lon", p.lon}});
  return shape;
}

std::expected<Asked, Refusal> read_asked(const nlohmann::json& json) {
  if (!json.is_object()) return std::unexpected("the request must be a JSON object");
  Asked asked;
  int digits = 6;
  auto places = read_places(json, digits);
  if (!places) return std::unexpected(places.error());
  asked.places = std::move(*places);

  const bool range = json.value("range", nlohmann::json(false)) == true;
  const auto distance = json.find("resample_distance");
  bool resampled = false;
  if (range || distance != json.end()) {
    const GeodesicPath way(asked.places);
    asked.range_m.assign(way.reached_m().begin(), way.reached_m().end());
    if (distance != json.end()) {
      if (!distance->is_number() || !(distance->get<double>() > 0))
        return std::unexpected("resample_distance must be metres, more than 0");
      resampled = asked.places.size() > 1;
      if (auto done = resample(asked, way, distance->get<double>()); !done)
        return std::unexpected(done.error());
    }
    if (!range) asked.range_m.clear();
  }
  if (const auto decimals = json.find("height_precision"); decimals != json.end()) {
    if (!decimals->is_number_integer() || *decimals < 0 || *decimals > kMostDecimals)
      return std::unexpected("height_precision must be 0, 1 or 2");
    asked.decimals = decimals->get<int>();
  }
  if (const auto id = json.find("id"); id != json.end() && id->is_string())
    asked.echoed["id"] = id->get<std::string>();
  if (json.contains("shape") || resampled)
    asked.echoed["shape"] = shape_of(asked.places);
  else
    asked.echoed["encoded_polyline"] = json["encoded_polyline"].get<std::string>();
  return asked;
}

/// Rounded as asked; 4393 and not 4393.0 where there are no decimals.
Ordered rounded(const std::optional<double>& height_m, int decimals) {
  if (!height_m) return nullptr;
  const double scale = std::pow(10, decimals);
  if (decimals == 0) return std::llround(*height_m);
  return std::round(*height_m * scale) / scale;
}

std::string answer_of(const Asked& asked, std::span<const LookedUp> found) {
  Ordered heights = Ordered::array();
  for (std::size_t i = 0; i < found.size(); ++i) {
    Ordered height = rounded(found[i].height_m, asked.decimals);
    if (asked.range_m.empty())
      heights.push_back(std::move(height));
    else
      heights.push_back(
          Ordered::array({std::round(asked.range_m[i] * 100) / 100, std::move(height)}));
  }
  Ordered json = asked.echoed;
  json[asked.range_m.empty() ? "height" : "range_height"] = std::move(heights);
  return json::to_text(json) + "\n";
}

/// The JSON of a GET.
std::expected<std::string, Refusal> read_query(std::string_view query) {
  const auto parameters = http::parse_query(query);
  if (!parameters) return std::unexpected(std::string("the query ") + http::kBadQuery);
  for (const auto& [name, value] : *parameters)
    if (name == "json") return value;
  return std::unexpected("there must be ?json={...}, or a POST with it as body");
}

http::Reply answer(const App& app, const Datasets& datasets, std::string_view text,
                   const std::string& target, const std::stop_token& stop) {
  const auto json = read_json(text);
  if (!json) return refused("the request: " + json.error());
  const auto asked = read_asked(*json);
  if (!asked) return refused(asked.error());
  const auto found = look_up(app, datasets, asked->places, Interpolation::bilinear, target, stop);
  if (!found) return found.error();
  return http::make_reply(200, "application/json", answer_of(*asked, *found),
                          {{"Cache-Control", "no-cache"}});
}

constexpr const char* kBody = R"({
  "type": "object",
  "properties": {
    "shape": {"type": "array", "minItems": 1, "maxItems": 100000, "items": {
      "type": "object",
      "required": ["lat", "lon"],
      "properties": {"lat": {"type": "number", "minimum": -90, "maximum": 90},
                     "lon": {"type": "number", "minimum": -180, "maximum": 180}}}},
    "encoded_polyline": {"type": "string"},
    "shape_format": {"enum": ["polyline6", "polyline5"]},
    "range": {"type": "boolean"},
    "resample_distance": {"type": "number", "minimum": 1},
    "height_precision": {"type": "integer", "minimum": 0, "maximum": 2},
    "id": {"type": "string"}
  },
  "anyOf": [{"required": ["shape"]}, {"required": ["encoded_polyline"]}]})";
constexpr const char* kExample = R"({"shape": [{"lat": 46.85, "lon": -121.76}], "range": true})";

http::Operation operation(bool post) {
  http::Operation made = {
      .id = post ? "postValhallaHeight" : "getValhallaHeight",
      .tag = "Heights as other services",
      .summary = "Heights as Valhalla gives them",
      .about = "Of all datasets, the finest first.",
      .heeds_access = true,
      .ignores_others = true,
      .responses = {{200, "The heights, in the same order.", {{"application/json", R"({
                       "type": "object",
                       "properties": {"shape": {"type": "array"},
                         "encoded_polyline": {"type": "string"}, "id": {"type": "string"},
                         "height": {"type": "array", "items": {"type": ["number", "null"]}},
                         "range_height": {"type": "array"}}})"}}},
                    {400, "The request is wrong.", {{"application/json", R"({
                       "type": "object",
                       "required": ["error", "status_code", "status"],
                       "properties": {"error": {"type": "string"},
                         "status_code": {"type": "integer"}, "status": {"type": "string"}}})"}}}}};
  if (post)
    made.body = {{"application/json", kBody, kExample}};
  else
    made.words = {
        {.name = "json",
         .words = {},
         .form = "the body of the POST",
         .pattern = "^\\{\"shape\":\\[\\{\"lat\":[1-8]?[0-9],\"lon\":-?[1-9][0-9]\\}\\]\\}$",
         .example = kExample}};
  return made;
}

}  // namespace

void add_valhalla_routes(http::Router& router, const App& app) {
  const std::string path = "/height";
  router.get(path, operation(false),
             [&app](const http::Request& request,
                    http::DeferredReply& deferred) -> std::optional<http::Reply> {
               auto text = read_query(request.head.query);
               if (!text) return refused(text.error());
               const services::Work work = work_of(*text);
               return answer_on_worker(
                   app, work, request, deferred,
                   [&app, datasets = all_finest_first(app, request), text = std::move(*text),
                    target = std::string(request.head.target)](const std::stop_token& stop) {
                     return answer(app, datasets, text, target, stop);
                   });
             });
  router.post(path, operation(true), {.max_bytes = kMostBody, .type = ""},
              [&app](const http::Request& request, http::DeferredReply& deferred) {
                return answer_on_worker(
                    app, work_of(request.body), request, deferred,
                    [&app, datasets = all_finest_first(app, request), body = request.body,
                     target = std::string(request.head.target)](const std::stop_token& stop) {
                      return answer(app, datasets, body, target, stop);
                    });
              });
}

}  // namespace tind::api
