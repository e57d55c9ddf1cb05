#include "server/api/tiles/tile_product.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "server/api/tiles/tile_address.h"
#include "server/http/message/negotiate.h"
#include "server/http/message/problem.h"

namespace tind::api {

namespace {

/// What kept a product from being made.
http::Reply not_made(const Error& error, const services::ServedDataset& dataset,
                     std::string_view target) {
  constexpr double kSoon = 2, kMost = 3600;  // seconds
  const Readiness now = dataset.tiles ? dataset.tiles->readiness() : Readiness{};
  if (error.code != Errc::busy || now.state != Readiness::State::reading)
    return http::problem_reply(error, target);
  const double wait =
      std::clamp(std::ceil(now.seconds_left.value_or(now.again_in_s.value_or(kSoon))), 1.0, kMost);
  return http::problem_reply(
      {.status = 503,
       .detail = "This rests on all heights of the dataset, which are still being read.",
       .instance = target,
       .headers = {{"Retry-After", std::to_string(int(wait))}}});
}

}  // namespace

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
  return [&products, &tile](services::TileProducts::Done done, http::Asker asker) {
    products.make(*tile.dataset, tile.id, std::move(done), std::move(asker));
  };
}

std::optional<http::Reply> answer_when_made(const http::Request& request,
                                            http::DeferredReply& deferred,
                                            const services::ServedDataset& dataset,
                                            const MakeProduct& make,
                                            std::function<http::Reply(const Product&)> answer) {
  auto responder = deferred.responder();
  http::Asker asker = responder.asker();
  make(
      [responder = std::move(responder), answer = std::move(answer),
       dataset = dataset.shared_from_this(),
       target = std::string(request.head.target)](const Result<Product>& made) mutable {
        responder(made ? answer(*made) : not_made(made.error(), *dataset, target));
      },
      std::move(asker));
  return std::nullopt;
}

std::optional<http::Reply> serve_product(const http::Request& request,
                                         http::DeferredReply& deferred,
                                         const services::ServedDataset& dataset,
                                         const Product& cached, const MakeProduct& make) {
  if (cached) return cached->reply(request.head.fields);
  return answer_when_made(request, deferred, dataset, make,
                          [client = http::Conditions(request.head.fields)](const Product& made) {
                            return made->reply(client);
                          });
}

std::optional<http::Reply> serve_product(const http::Request& request,
                                         http::DeferredReply& deferred, const AskedTile& tile,
                                         services::TileProducts& products) {
  return serve_product(request, deferred, *tile.dataset, products.cached(*tile.dataset, tile.id),
                       make_of(products, tile));
}

}  // namespace tind::api
