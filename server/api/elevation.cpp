// /elevation/{dataset}?lon=&lat=&datum=: the height of a place, from the DEM.

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/accuracy_json.h"
#include "server/api/app.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"
#include "terrain/raster/datums.h"
#include "terrain/surface/height_field.h"

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

/// EPSG:5703 and the like: nothing that could name a file.
bool is_epsg_code(std::string_view text) {
  constexpr std::string_view kAuthority = "EPSG:";
  if (!text.starts_with(kAuthority)) return false;
  text.remove_prefix(kAuthority.size());
  return !text.empty() && text.size() <= 6 &&
         text.find_first_not_of("0123456789") == std::string_view::npos;
}

const http::QueryWord kWords[] = {{"datum",
                                   {"source", "ellipsoid", "egm84", "egm96", "egm2008"},
                                   is_epsg_code,
                                   "EPSG:CODE of a vertical CRS"}};

/// What an answer may say of the datum: neither where grids are looked for nor which are there.
std::unexpected<Error> not_above(const std::string& word, const char* why) {
  return fail(Errc::invalid_argument, "cannot be " + word + ": " + why);
}

/// The datum of a word of the query.
Result<VerticalDatum> datum_of(const std::string& word, const DemInfo& info) {
  if (word.empty() || word == "source") return info.source_datum;
  auto datum = datum_named(word);
  if (!datum) return not_above(word, "PROJ knows no such vertical CRS that counts upwards");
  if (*datum != info.datum && info.datum == VerticalDatum::unknown)
    return not_above(word, "what this DEM's heights are above is not known");
  return datum;
}

/// The height as it is above another datum.
Result<HeightAt> convert(const Environment& environment, HeightAt height, const Geographic& where,
                         const DemInfo& info, const VerticalDatum& to) {
  if (info.datum == to || height.coverage != Coverage::value) return height;
  double sign = 1;
  for (const VerticalDatum& datum : {info.datum, to}) {
    const auto surface = datum_surface(datum, info.bounds, info.crs_wkt, environment);
    if (!surface) return not_above(name(to), "its grid is not here, or does not reach there");
    double above = 0;
    if (*surface) (*surface)->undulations({&where, 1}, {&above, 1});
    if (std::isnan(above)) return not_above(name(to), "its grid does not reach there");
    height.height_m += sign * above;
    sign = -1;
  }
  height.height_m = std::round(height.height_m * 1000) / 1000;  // it was rounded once already
  return height;
}

http::Reply answer(const services::ServedDataset& dataset, const Geographic& where,
                   const SurfaceHeight& answered, const VerticalDatum& datum) {
  const HeightAt& found = answered.height;
  const SurfaceLayer& layer = dataset.source->layers()[answered.layer];
  const DemInfo& info = layer.source->info();
  nlohmann::ordered_json json = {{"coverage", word(found.coverage)}};
  json["height_m"] = found.coverage == Coverage::value ? nlohmann::ordered_json(found.height_m)
                                                       : nlohmann::ordered_json(nullptr);
  json["datum"] = name(datum);
  if (info.accuracy) json["accuracy"] = accuracy_json(*info.accuracy);
  json["source"] = dataset.name;
  if (!dataset.source->only() && found.coverage == Coverage::value) {
    json["layer"] = layer.name;
    json["spacing_m"] = {info.spacing_x_m, info.spacing_y_m};
  }
  json["lon"] = where.lon;
  json["lat"] = where.lat;
  return http::make_reply(200, "application/json", json.dump() + "\n",
                          {{"Cache-Control", "no-cache"}});
}

std::optional<http::Reply> elevation(const App& app, const http::Request& request,
                                     http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->source) return no_source(request);
  auto query = http::read_numbers(request.head.query, kQuery, kWords);
  if (query.problems.empty())
    for (std::size_t k = 0; k < 2; ++k)
      if (!query.values[k])
        query.problems.push_back({std::string(kQuery[k].name), "missing: decimal degrees"});
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  const Geographic where{*query.values[0], *query.values[1]};
  return answer_on_worker(app, services::Work::question, request, deferred,
                          [&app, dataset, where, word = query.words[0],
                           target = std::string(request.head.target)](const std::stop_token&) {
                            const Surface& surface = *dataset->source;
                            auto found = height_at(surface, where);
                            if (!found) return http::problem_reply(found.error(), target);
                            const DemInfo& info = surface.layers()[found->layer].source->info();
                            const auto datum = datum_of(word, info);
                            const auto above =
                                datum ? convert(app.environment, found->height, where, info, *datum)
                                      : Result<HeightAt>(std::unexpected(datum.error()));
                            if (!above)
                              return http::problem_reply({{"datum", above.error().what}}, target);
                            found->height = *above;
                            return answer(*dataset, where, *found, *datum);
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
