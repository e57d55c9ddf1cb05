#include "server/api/tile_product.h"

#include <string>
#include <utility>

#include "server/api/tile_address.h"
#include "server/http/message/negotiate.h"
#include "server/http/message/problem.h"

namespace tind::api {

http::Reply no_tile(const http::Request& request, std::string_view detail) {
  return http::problem_reply(
      {.status = 404, .detail = std::string(detail), .instance = request.head.target});
}

std::expected<AskedTile, http::Reply> find_tile(const App& app, const http::Request& request,
                                                std::string_view detail) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::unexpected(std::move(not_found));
  const auto id = tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!id || !dataset->has(*id)) return std::unexpected(no_tile(request, detail));
  return AskedTile{std::move(dataset), *id};
}

MakeProduct make_of(services::TileProducts& products, const AskedTile& tile) {
  return [&products, &tile](services::TileProducts::Done done, std::stop_token gone) {
    products.make(*tile.dataset, tile.id, std::move(done), std::move(gone));
  };
}

std::optional<http::Reply> answer_when_made(const http::Request& request,
                                            http::DeferredReply& deferred, const MakeProduct& make,
                                            std::function<http::Reply(const Product&)> answer) {
  auto responder = deferred.responder();
  const std::stop_token gone = responder.gone();
  make(
      [responder = std::move(responder), answer = std::move(answer),
       target = std::string(request.head.target)](const Result<Product>& made) mutable {
        responder(made ? answer(*made) : http::problem_reply(made.error(), target));
      },
      gone);
  return std::nullopt;
}

std::optional<http::Reply> serve_product(const http::Request& request,
                                         http::DeferredReply& deferred, const Product& cached,
                                         const MakeProduct& make) {
  if (cached) return cached->reply(request.head.fields);
  return answer_when_made(request, deferred, make,
                          [client = http::Conditions(request.head.fields)](const Product& made) {
                            return made->reply(client);
                          });
}

std::optional<http::Reply> serve_product(const http::Request& request,
                                         http::DeferredReply& deferred, const AskedTile& tile,
                                         services::TileProducts& products) {
  return serve_product(request, deferred, products.cached(*tile.dataset, tile.id),
                       make_of(products, tile));
}

}  // namespace tind::api
