// /elevation/{dataset}?lon=&lat=: the height of a place, from the DEM.

#include <charconv>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/app.h"
#include "server/http/problem.h"
#include "server/http/uri.h"

namespace tind::api {
namespace {

struct Place {
  Geographic where;
  std::vector<http::ParameterProblem> problems;
};

void read_degrees(const std::vector<http::Parameter>& parameters, const std::string& name,
                  double limit, double& value, std::vector<http::ParameterProblem>& problems) {
  const http::Parameter* found = nullptr;
  for (const http::Parameter& parameter : parameters) {
    if (parameter.name != name) continue;
    if (found) return problems.push_back({name, "given twice"});
    found = &parameter;
  }
  if (!found) return problems.push_back({name, "missing: decimal degrees"});
  const char* const end = found->value.data() + found->value.size();
  const auto [stop, error] = std::from_chars(found->value.data(), end, value);
  const bool fine = error == std::errc() && stop == end && value >= -limit && value <= limit;
  if (!fine)
    problems.push_back({name, "must be decimal degrees from -" + std::to_string(int(limit)) +
                                  " to " + std::to_string(int(limit))});
}

Place parse_place(std::string_view query) {
  Place place;
  const auto parameters = http::parse_query(query);
  if (!parameters) {
    place.problems.push_back({"query", "holds a bad percent-escape"});
    return place;
  }
  read_degrees(*parameters, "lon", 360, place.where.lon, place.problems);
  read_degrees(*parameters, "lat", 90, place.where.lat, place.problems);
  for (const http::Parameter& parameter : *parameters)
    if (parameter.name != "lon" && parameter.name != "lat")
      place.problems.push_back({parameter.name, "is not a parameter of this resource"});
  return place;
}

const char* word(Coverage coverage) {
  switch (coverage) {
    case Coverage::value:
      return "value";
    case Coverage::void_:
      return "void";
    case Coverage::outside:
      return "outside";
  }
  return "outside";
}

http::Reply answer(const services::Dataset& dataset, const Geographic& where,
                   const HeightAt& found) {
  nlohmann::ordered_json json = {{"coverage", word(found.coverage)}};
  json["height_m"] = found.coverage == Coverage::value ? nlohmann::ordered_json(found.height_m)
                                                       : nlohmann::ordered_json(nullptr);
  json["datum"] = name(dataset.tiles->dem()->info().datum);
  json["source"] = dataset.name;
  json["lon"] = where.lon;
  json["lat"] = where.lat;
  return http::make_reply(200, "application/json", json.dump() + "\n",
                          {{"Cache-Control", "no-cache"}});
}

std::optional<http::Reply> elevation(const App& app, const http::Request& request,
                                     http::Later& later) {
  const auto [found, not_found] = find_dataset(app, request.matched[0], request);
  if (!found) return not_found;
  const services::Dataset& dataset = *found;
  if (!dataset.tiles->dem())
    return http::problem_reply({.status = 404,
                                .detail = "This dataset is a store of tiles without its DEM.",
                                .instance = request.head.target});
  Place place = parse_place(request.head.query);
  if (!place.problems.empty())
    return http::problem_reply({.status = 400,
                                .detail = "A parameter is wrong: " + place.problems[0].parameter +
                                          " " + place.problems[0].detail + ".",
                                .instance = request.head.target,
                                .errors = place.problems});
  auto permit = app.pool.admit();
  if (!permit) return http::problem_reply(permit.error(), request.head.target);
  app.pool.run(std::move(*permit),
               [&dataset, where = place.where, target = std::string(request.head.target),
                responder = later.responder()](std::stop_token) mutable {
                 const auto height = height_at(*dataset.tiles->dem(), where);
                 responder(height ? answer(dataset, where, *height)
                                  : http::problem_reply(height.error(), target));
               });
  return std::nullopt;
}

}  // namespace

void add_elevation_routes(http::Router& router, const App& app) {
  router.get("/elevation/{dataset}", [&app](const http::Request& request, http::Later& later) {
    return elevation(app, request, later);
  });
}

}  // namespace tind::api
