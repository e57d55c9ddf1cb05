// /elevation/{dataset}?lon=&lat=&datum=: the height of a place, from the DEM.

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/accuracy_json.h"
#include "server/api/app.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"

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

const http::QueryWord kWords[] = {{"datum", {"source", "ellipsoid"}}};

/// The height as it is above another datum. REQUIRES: both known, or the same.
Result<HeightAt> convert(const Environment& environment, HeightAt height, const Geographic& where,
                         VerticalDatum from, VerticalDatum to) {
  if (from == to || height.coverage != Coverage::value) return height;
  const auto geoid = environment.egm96();
  if (!geoid) return std::unexpected(geoid.error());
  const double above = (*geoid)->undulation(where);
  height.height_m += to == VerticalDatum::ellipsoid ? above : -above;
  height.height_m = std::round(height.height_m * 1000) / 1000;  // it was rounded once already
  return height;
}

http::Reply answer(const services::ServedDataset& dataset, const Geographic& where,
                   const HeightAt& found, VerticalDatum datum) {
  nlohmann::ordered_json json = {{"coverage", word(found.coverage)}};
  json["height_m"] = found.coverage == Coverage::value ? nlohmann::ordered_json(found.height_m)
                                                       : nlohmann::ordered_json(nullptr);
  json["datum"] = name(datum);
  if (const auto& accuracy = dataset.source->info().accuracy)
    json["accuracy"] = accuracy_json(*accuracy);
  json["source"] = dataset.name;
  json["lon"] = where.lon;
  json["lat"] = where.lat;
  return http::make_reply(200, "application/json", json.dump() + "\n",
                          {{"Cache-Control", "no-cache"}});
}

std::optional<http::Reply> elevation(const App& app, const http::Request& request,
                                     http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->source)
    return http::problem_reply({.status = 404,
                                .detail = "This dataset is a store of tiles without its DEM.",
                                .instance = request.head.target});
  auto query = http::read_numbers(request.head.query, kQuery, kWords);
  if (query.problems.empty())
    for (std::size_t k = 0; k < 2; ++k)
      if (!query.values[k])
        query.problems.push_back({std::string(kQuery[k].name), "missing: decimal degrees"});
  const DemInfo& info = dataset->source->info();
  const VerticalDatum datum =
      query.words[0] == "ellipsoid" ? VerticalDatum::ellipsoid : info.source_datum;
  if (datum != info.datum && info.datum == VerticalDatum::unknown)
    query.problems.push_back(
        {"datum", "cannot be ellipsoid: what this DEM's heights are above is not known"});
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  const Geographic where{*query.values[0], *query.values[1]};
  return answer_on_worker(app, services::Work::question, request, deferred,
                          [&app, dataset, where, datum,
                           target = std::string(request.head.target)](const std::stop_token&) {
                            const DemSource& dem = *dataset->source->only();
                            auto height = height_at(dem, where);
                            if (height)
                              height =
                                  convert(app.environment, *height, where, dem.info().datum, datum);
                            return height ? answer(*dataset, where, *height, datum)
                                          : http::problem_reply(height.error(), target);
                          });
}

}  // namespace

void add_elevation_routes(http::Router& router, const App& app) {
  router.get("/elevation/{dataset}",
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return elevation(app, request, deferred);
             });
}

}  // namespace tind::api
