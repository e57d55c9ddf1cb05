// /collections/{id}/position, trajectory, corridor, area and cube (OGC API - Environmental Data
// Retrieval, 19-086r6).

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "server/api/elevation/lookups.h"
#include "server/api/ogc/collection_json.h"
#include "server/api/ogc/edr_answer.h"
#include "server/api/ogc/edr_places.h"
#include "server/api/ogc/edr_query.h"
#include "server/api/ogc/routes.h"
#include "server/http/message/problem.h"
#include "terrain/geo/longitude.h"

namespace tind::api::ogc {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Of those places that there are.
std::expected<EdrHeights, http::Reply> heights_there(
    const App& app, const services::ServedDataset& dataset, std::span<const Geographic> where,
    const HeightQuestion& question, std::string_view target, const std::stop_token& stop) {
  std::vector<Geographic> asked;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < where.size(); ++i) {
    if (std::isnan(where[i].lon)) continue;
    asked.push_back(std::abs(where[i].lon) > 180 ? within_first_turn(where[i]) : where[i]);
    which.push_back(i);
  }
  const auto found = heights_of(app, dataset, asked, question, target, stop);
  if (!found) return std::unexpected(found.error());
  EdrHeights heights{found->datum, std::vector<double>(where.size(), kNaN), {}, {}};
  bool all_bands = question.level.has_value();
  for (std::size_t n = 0; n < which.size(); ++n) {
    const PlaceHeight& place = found->places[n];
    if (place.height.coverage == Coverage::value) heights.values[which[n]] = place.height.height_m;
    if (place.max_error_m)
      heights.max_error_m = std::max(heights.max_error_m.value_or(0), *place.max_error_m);
    if (place.height.coverage != Coverage::value) continue;
    all_bands = all_bands && place.band;
    if (all_bands)
      heights.off_m = std::max({heights.off_m.value_or(0), place.band->high_m, -place.band->low_m});
  }
  if (!all_bands) heights.off_m.reset();
  return heights;
}

http::Reply answer(const App& app, const services::ServedDataset& dataset, const EdrQuery& query,
                   const std::string& target, const std::stop_token& stop) {
  const auto crs = AskedCrs::make(query.crs, dataset.facts());
  if (!crs) return http::problem_reply({{"crs", crs.error().what}}, target);
  const auto places = edr_places(query, *crs, spacing_m(dataset));
  if (!places) return http::problem_reply({places.error()}, target);
  const auto heights = heights_there(app, dataset, places->where, query.question, target, stop);
  if (!heights) return heights.error();
  return http::make_reply(200,
                          query.geojson ? "application/geo+json" : "application/prs.coverage+json",
                          query.geojson ? geojson_of(query, *places, *heights)
                                        : coverage_json_of(query, *crs, *places, *heights),
                          {{"Cache-Control", "no-cache"}, {"Vary", "Accept"}});
}

std::size_t points_of(const proto::WktGeometry& coords) {
  std::size_t points = 0;
  for (const auto& lines : coords.parts)
    for (const proto::WktLine& line : lines) points += line.size();
  return points;
}

std::optional<http::Reply> ask(const App& app, EdrShape shape, const http::Request& request,
                               http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  auto query = read_edr_query(shape, request.head.query, request.head.fields);
  if (!query) return http::problem_reply(query.error(), request.head.target);
  // Of tiles without their DEM: the deepest meshes.
  if (!dataset->source && !query->question.level)
    query->question.level = dataset->tiles->layer().maxzoom;
  if (auto none = no_such_heights(*dataset, query->question, request)) return none;
  const bool quick = shape == EdrShape::position && !query->question.level;
  const services::Work work =
      quick ? work_of(*dataset, points_of(query->coords)) : services::Work::batch;
  return answer_on_worker(
      app, work, request, deferred,
      [&app, dataset, query = std::move(*query), target = std::string(request.head.target)](
          const std::stop_token& stop) { return answer(app, *dataset, query, target, stop); });
}

}  // namespace

void add_edr_routes(http::Router& router, const App& app) {
  for (const auto& [shape, name] : EnumNames<EdrShape>::kAll)
    router.get(std::string("/collections/{collectionId}/") + name, edr_operation(shape),
               [&app, shape](const http::Request& request, http::DeferredReply& deferred) {
                 return ask(app, shape, request, deferred);
               });
}

}  // namespace tind::api::ogc
