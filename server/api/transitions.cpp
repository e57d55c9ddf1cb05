// /transition/{dataset}/{z}/{x}/{y}: the way from a tile to its parent's part, without a pop.

#include <array>
#include <string>

#include "server/api/app.h"
#include "server/api/tile_address.h"
#include "server/http/problem.h"
#include "terrain/pyramid/tile_transition.h"

namespace tind::api {
namespace {

std::shared_ptr<const http::Representation> represent(const std::vector<std::uint8_t>& bytes) {
  return http::Representation::make(
      {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
      {.content_type = "application/vnd.tind.transition", .cache_control = "public, max-age=3600"});
}

/// On a worker: both tiles, then the way between them.
Result<std::shared_ptr<const http::Representation>> make(const TileSet& tiles, TileId id,
                                                         std::stop_token stop) {
  const auto fine = tiles.tile(id, stop);
  if (!fine) return std::unexpected(fine.error());
  const auto parent = tiles.tile(id.parent(), stop);
  if (!parent) return std::unexpected(parent.error());
  const auto made = tile_transition(id, *fine, *parent);
  if (!made) return std::unexpected(made.error());
  return represent(proto::encode(*made));
}

std::optional<http::Reply> transition(const App& app, const http::Request& request,
                                      http::Later& later) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto id = tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!id || id->level == 0 || !dataset->tiles->available(*id) ||
      !dataset->tiles->available(id->parent()))
    return http::problem_reply({.status = 404,
                                .detail = "There is no such tile, or it has no parent.",
                                .instance = request.head.target});
  auto permit = app.pool.admit();
  if (!permit) return http::problem_reply(permit.error(), request.head.target);
  app.pool.run(std::move(*permit), [dataset, id = *id, responder = later.responder(),
                                    client = http::Conditions(request.head.fields),
                                    target = std::string(request.head.target)](
                                       std::stop_token stop) mutable {
    const auto made = make(*dataset->tiles, id, stop);
    responder(made ? (*made)->reply(client) : http::problem_reply(made.error(), target));
  });
  return std::nullopt;
}

}  // namespace

void add_transition_routes(http::Router& router, const App& app) {
  router.get("/transition/{dataset}/{z}/{x}/{y}",
             [&app](const http::Request& request, http::Later& later) {
               return transition(app, request, later);
             });
}

}  // namespace tind::api
