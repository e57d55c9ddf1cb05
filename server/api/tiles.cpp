// /terrain/{dataset}/layer.json and /terrain/{dataset}/{z}/{x}/{y}.terrain: a cached tile is
// answered at once, on the I/O thread; any other goes through the CPU pool.

#include <utility>

#include "server/api/app.h"
#include "server/api/extensions.h"
#include "server/api/tile_product.h"

namespace tind::api {
namespace {

std::optional<http::Reply> tile(const App& app, const http::Request& request,
                                http::DeferredReply& deferred) {
  auto found = find_tile(app, request);
  if (!found) return std::move(found.error());
  const services::ServedDataset& dataset = *found->dataset;
  const proto::Extensions asked = asked_extensions(request.head.fields, request.head.query);
  return serve_product(request, deferred, app.tiles.cached(dataset, found->id, asked),
                       [&](services::TileProducts::Done done, std::stop_token gone) {
                         app.tiles.make(dataset, found->id, asked, std::move(done),
                                        std::move(gone));
                       });
}

std::optional<http::Reply> layer_json(const App& app, const http::Request& request) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->tiles) return no_tiles(request);
  return dataset->layer_json->reply(request.head.fields);
}

}  // namespace

void add_tile_routes(http::Router& router, const App& app) {
  router.get("/terrain/{dataset}/{z}/{x}/{y}.terrain",
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return tile(app, request, deferred);
             });
  router.get("/terrain/{dataset}/layer.json",
             [&app](const http::Request& request, http::DeferredReply&) {
               return layer_json(app, request);
             });
}

}  // namespace tind::api
