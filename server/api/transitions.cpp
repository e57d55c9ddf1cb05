// /transition/{dataset}/{z}/{x}/{y}: the way from a tile to its parent's part, without a pop.

#include <string>

#include "server/api/app.h"
#include "server/api/tile_address.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

std::optional<http::Reply> transition(const App& app, const http::Request& request,
                                      http::Later& later) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto id = tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!id || id->level == 0 || !dataset->has(*id) || !dataset->has(id->parent()))
    return http::problem_reply({.status = 404,
                                .detail = "There is no such tile, or it has no parent.",
                                .instance = request.head.target});
  if (const auto hit = app.transitions->cached(*dataset, *id))
    return hit->reply(request.head.fields);
  auto responder = later.responder();
  const std::stop_token gone = responder.gone();
  app.transitions->make(
      *dataset, *id,
      [responder = std::move(responder), client = http::Conditions(request.head.fields),
       target = std::string(request.head.target)](const auto& made) mutable {
        responder(made ? (*made)->reply(client) : http::problem_reply(made.error(), target));
      },
      gone);
  return std::nullopt;
}

}  // namespace

void add_transition_routes(http::Router& router, const App& app) {
  if (!app.transitions) return;
  router.get("/transition/{dataset}/{z}/{x}/{y}",
             [&app](const http::Request& request, http::Later& later) {
               return transition(app, request, later);
             });
}

}  // namespace tind::api
