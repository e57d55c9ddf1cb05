// /terrain/{dataset}/{z}/{x}/{y}.glb, and whatever other formats the table of encoders has.

#include <string>

#include "server/api/app.h"
#include "server/api/responses.h"
#include "server/api/tiles/tile_product.h"

namespace tind::api {
namespace {

std::optional<http::Reply> encoded_tile(const App& app, services::TileProducts& products,
                                        const http::Request& request,
                                        http::DeferredReply& deferred) {
  auto tile = find_tile(app, request);
  if (!tile) return std::move(tile.error());
  return serve_product(request, deferred, *tile, products);
}

http::Operation operation_of(const services::TileEncodings::Encoding& encoding) {
  return {.id = "getTileAs_" + std::string(encoding.format.extension),
          .tag = "Tiles",
          .summary = "One tile as " + std::string(encoding.format.name),
          .scope = http::Scope::tiles,
          .ignores_others = true,
          .responses = resource("The tile.", std::string(encoding.format.media_type))};
}

}  // namespace

void add_encoding_routes(http::Router& router, const App& app) {
  if (!app.encodings) return;
  for (const auto& encoding : app.encodings->all())
    router.get("/terrain/{dataset}/{z}/{x}/{y}." + std::string(encoding.format.extension),
               operation_of(encoding),
               [&app, products = encoding.products.get()](const http::Request& request,
                                                          http::DeferredReply& deferred) {
                 return encoded_tile(app, *products, request, deferred);
               });
}

}  // namespace tind::api
