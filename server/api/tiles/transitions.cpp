// /transition/{dataset}/{z}/{x}/{y}: the way from a tile to its parent's part, without a pop.

#include <string_view>

#include "server/api/app.h"
#include "server/api/responses.h"
#include "server/api/tiles/tile_product.h"

namespace tind::api {
namespace {

constexpr std::string_view kNoWay = "There is no such tile, or it has no parent.";

std::optional<http::Reply> transition(const App& app, const http::Request& request,
                                      http::DeferredReply& deferred) {
  auto tile = find_tile(app, request, kNoWay);
  if (!tile) return std::move(tile.error());
  if (tile->id.level == 0 || !tile->dataset->has(tile->id.parent()))
    return no_tile(request, kNoWay);
  return serve_product(request, deferred, *tile, *app.transitions);
}

const http::Operation kTransition = {
    .id = "getTransition",
    .tag = "Flights and cameras",
    .summary = "From a tile's parent to the tile, without a pop",
    .scope = http::Scope::tiles,
    .ignores_others = true,
    .responses = resource("The transition.", "application/vnd.tind.transition")};

}  // namespace

void add_transition_routes(http::Router& router, const App& app) {
  if (!app.transitions) return;
  router.get("/transition/{dataset}/{z}/{x}/{y}", kTransition,
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return transition(app, request, deferred);
             });
}

}  // namespace tind::api
