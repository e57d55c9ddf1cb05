// /terrain/{dataset}/layer.json and /terrain/{dataset}/{z}/{x}/{y}.terrain: a cached tile is
// answered at once, on the I/O thread; any other goes through the CPU pool.

#include <string>

#include "server/api/app.h"
#include "server/api/extensions.h"
#include "server/api/tile_address.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

http::Reply no_tile(std::string_view target) {
  return http::problem_reply({.status = 404,
                              .detail = "There is no such tile; layer.json says which exist.",
                              .instance = target});
}

std::optional<http::Reply> tile(const App& app, const http::Request& request, http::Later& later) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto id = tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!id || !dataset->has(*id)) return no_tile(request.head.target);
  const proto::Extensions asked = asked_extensions(request.head.fields, request.head.query);
  if (const auto hit = app.tiles.cached(*dataset, *id, asked))
    return hit->reply(request.head.fields);
  auto responder = later.responder();
  const std::stop_token gone = responder.gone();
  app.tiles.make(
      *dataset, *id, asked,
      [responder = std::move(responder), client = http::Conditions(request.head.fields),
       target = std::string(request.head.target)](auto made) mutable {
        if (made) {
          responder((*made)->reply(client));
        } else {
          responder(http::problem_reply(made.error(), target));
        }
      },
      gone);
  return std::nullopt;
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
             [&app](const http::Request& request, http::Later& later) {
               return tile(app, request, later);
             });
  router.get("/terrain/{dataset}/layer.json", [&app](const http::Request& request, http::Later&) {
    return layer_json(app, request);
  });
}

}  // namespace tind::api
