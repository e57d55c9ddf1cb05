// /terrain/{dataset}/{z}/{x}/{y}.glb, and whatever other formats the table of encoders has.

#include <string>

#include "server/api/app.h"
#include "server/api/tile_address.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

std::optional<http::Reply> encoded_tile(const App& app, services::TileProducts& products,
                                        const http::Request& request, http::Later& later) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto id = tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!id || !dataset->has(*id))
    return http::problem_reply({.status = 404,
                                .detail = "There is no such tile; layer.json says which exist.",
                                .instance = request.head.target});
  if (const auto hit = products.cached(*dataset, *id)) return hit->reply(request.head.fields);
  auto responder = later.responder();
  const std::stop_token gone = responder.gone();
  products.make(
      *dataset, *id,
      [responder = std::move(responder), client = http::Conditions(request.head.fields),
       target = std::string(request.head.target)](const auto& made) mutable {
        responder(made ? (*made)->reply(client) : http::problem_reply(made.error(), target));
      },
      gone);
  return std::nullopt;
}

}  // namespace

void add_encoding_routes(http::Router& router, const App& app) {
  if (!app.encodings) return;
  for (const auto& encoding : app.encodings->all())
    router.get("/terrain/{dataset}/{z}/{x}/{y}." + std::string(encoding.format.extension),
               [&app, products = encoding.products.get()](const http::Request& request,
                                                          http::Later& later) {
                 return encoded_tile(app, *products, request, later);
               });
}

}  // namespace tind::api
