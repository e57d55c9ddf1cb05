// /collections/{id}/coverage: a window of heights, in any system, of any size. A pixel is the mean
// of H over it, as heightmaps have it (terrain/heightmaps/height_lattice.h).

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <utility>

#include "server/api/elevation/heights.h"
#include "server/api/ogc/coverage_file.h"
#include "server/api/ogc/coverage_query.h"
#include "server/api/ogc/routes.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/problem.h"
#include "terrain/heightmaps/height_lattice.h"
#include "terrain/raster/crs_code.h"

namespace tind::api::ogc {
namespace {

/// Read for one answer, which has a worker until it is made: for a minute or two. Of a DEM that has
/// no more, all can be asked for.
constexpr std::int64_t kMostPosts = std::int64_t(1) << 29;

RasterLattice lattice_of(const AskedCrs& crs, const CoverageWindow& w) {
  RasterLattice lattice;
  lattice.cols = w.cols, lattice.rows = w.rows;
  lattice.spacing_m = w.pixel_m;
  lattice.places = [&crs, w](double row, double first, std::span<Geographic> out) {
    const double dx = w.box.width() / w.cols, dy = w.box.height() / w.rows;
    std::vector<Vec2> points;
    points.reserve(out.size());
    for (std::size_t i = 0; i < out.size(); ++i)
      points.push_back({w.box.west + (first + double(i) + .5) * dx, w.box.north - (row + .5) * dy});
    crs.to_geographic(points, out);
  };
  return lattice;
}

/// In place, row by row.
Result<void> bring_to(const Environment& environment, const RasterLattice& lattice,
                      std::span<float> heights, const DemInfo& info, const VerticalDatum& to) {
  if (info.datum == to) return {};
  const auto cols = std::size_t(lattice.cols);
  std::vector<Geographic> where(cols);
  std::vector<double> row(cols);
  for (std::size_t j = 0; j < std::size_t(lattice.rows); ++j) {
    const auto strip = heights.subspan(j * cols, cols);
    lattice.places(double(j), 0, where);
    std::copy(strip.begin(), strip.end(), row.begin());
    if (auto done = bring_to_datum(environment, where, row, info, to); !done) return done;
    for (std::size_t i = 0; i < cols; ++i) strip[i] = float(row[i]);
  }
  return {};
}

http::Reply answer(const App& app, const services::ServedDataset& dataset, const CoverageQuery& q,
                   const std::string& target, const std::stop_token& stop) {
  const DatasetFacts facts = dataset.facts();
  const auto bbox_crs = AskedCrs::make(q.bbox_crs, facts);
  if (!bbox_crs) return http::problem_reply({{"bbox-crs", bbox_crs.error().what}}, target);
  const auto crs = q.crs == q.bbox_crs ? bbox_crs : AskedCrs::make(q.crs, facts);
  if (!crs) return http::problem_reply({{"crs", crs.error().what}}, target);
  const Surface& surface = *dataset.source;
  const DemInfo& info = surface.layers()[0].source->info();
  const auto datum = datum_asked(q.datum, info);
  if (!datum) return http::problem_reply({{"datum", datum.error().what}}, target);
  const auto code = crs_code(info.crs_wkt);
  if (!code) return http::problem_reply(code.error(), target);
  const bool is_own = surface.only() && crs->name() == fmt::format("EPSG:{}", code->epsg);
  const auto grid = is_own ? own_grid(q, *crs, info) : std::nullopt;
  const std::expected<CoverageWindow, http::ParameterProblem> window =
      grid ? *grid
           : coverage_window(q, *bbox_crs, *crs, facts, PostGrid(*bbox_crs, surface),
                             PostGrid(*crs, surface));
  if (!window) return http::problem_reply({window.error()}, target);

  const RasterLattice lattice = lattice_of(*crs, *window);
  if (takes_more_posts(surface, lattice, double(kMostPosts), stop))
    return http::problem_reply(
        {{"bbox", fmt::format("has more posts of the DEM under it than the {} that one answer may "
                              "take to read: ask for a smaller one",
                              kMostPosts)}},
        target);
  auto made = lattice_heights(surface, lattice, {.threads = 1}, {.report = {}, .stop = stop});
  if (!made) return http::problem_reply(made.error(), target);
  if (auto done = bring_to(app.environment, lattice, made->heights, info, *datum); !done)
    return http::problem_reply({{"datum", done.error().what}}, target);
  const auto file = coverage_file(q.format, *crs, {*window, std::move(made->heights), *datum});
  if (!file) return http::problem_reply(file.error(), target);
  return http::make_reply(200, file->media_type, file->bytes,
                          {{"Cache-Control", "no-cache"}, {"Vary", "Accept"}});
}

std::optional<http::Reply> ask(const App& app, const http::Request& request,
                               http::DeferredReply& deferred) {
  const auto dataset = find_with_source(app, request);
  if (!dataset) return dataset.error();
  auto query = read_coverage_query(request.head.query, request.head.fields);
  if (!query) return http::problem_reply(query.error(), request.head.target);
  return answer_on_worker(app, services::Work::batch, request, deferred,
                          [&app, found = *dataset, query = std::move(*query),
                           target = std::string(request.head.target)](const std::stop_token& stop) {
                            return answer(app, *found, query, target, stop);
                          });
}

}  // namespace

void add_coverage_routes(http::Router& router, const App& app) {
  router.get("/collections/{collectionId}/coverage", coverage_operation(),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return ask(app, request, deferred);
             });
}

}  // namespace tind::api::ogc
