// /elevation/{dataset}?lon=&lat=: the height of a place, from the DEM.

#include <nlohmann/json.hpp>
#include <string>

#include "server/api/app.h"
#include "server/http/problem.h"
#include "server/http/query_numbers.h"

namespace tind::api {
namespace {

constexpr http::QueryNumber kQuery[] = {{"lon", -360, 360, "decimal degrees"},
                                        {"lat", -90, 90, "decimal degrees"}};

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
  auto query = http::read_numbers(request.head.query, kQuery);
  if (query.problems.empty())
    for (std::size_t k = 0; k < 2; ++k)
      if (!query.values[k])
        query.problems.push_back({std::string(kQuery[k].name), "missing: decimal degrees"});
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  const Geographic where{*query.values[0], *query.values[1]};
  auto permit = app.pool.admit();
  if (!permit) return http::problem_reply(permit.error(), request.head.target);
  app.pool.run(std::move(*permit), [&dataset, where, target = std::string(request.head.target),
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
