#pragma once
// What the resources /.../{dataset}/{z}/{x}/{y} have in common: which tile is asked for, and how
// what is made of it is answered.

#include <expected>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "server/api/app.h"
#include "server/http/message/reply.h"
#include "server/http/message/request.h"
#include "server/http/router.h"
#include "server/services/tiles/tile_products.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind::api {

inline constexpr std::string_view kNoTile = "There is no such tile; layer.json says which exist.";

/// The 404 of a tile that is not there, with this detail.
http::Reply no_tile(const http::Request&, std::string_view detail = kNoTile);

/// A tile that its dataset has.
struct AskedTile {
  std::shared_ptr<const services::ServedDataset> dataset;
  TileId id;
};
/// What the path names, its first four parts being {dataset}/{z}/{x}/{y}; or the 404, of the
/// dataset or of the tile.
std::expected<AskedTile, http::Reply> find_tile(const App&, const http::Request&,
                                                std::string_view detail = kNoTile);

using Product = services::TileProducts::Product;
/// Makes the product and tells `done` once, from whatever thread.
using MakeProduct = std::function<void(services::TileProducts::Done done, http::Asker asker)>;

/// Of a kind of product that is made of nothing but the tile. Both outlive it.
MakeProduct make_of(services::TileProducts&, const AskedTile&);

/// A product of a dataset that is not in the cache: `answer` of it when it is made, on the thread
/// that made it, or the problem that kept it from being made; where that is heights that are still
/// being read, with the time that this will take in Retry-After. Always nothing, which is what a
/// handler returns then.
std::optional<http::Reply> answer_when_made(const http::Request&, http::DeferredReply&,
                                            const services::ServedDataset&, const MakeProduct&,
                                            std::function<http::Reply(const Product&)> answer);

/// The product as this client can take it (200, or 304): `cached` at once, on this thread; where
/// that is null, when it is made.
std::optional<http::Reply> serve_product(const http::Request&, http::DeferredReply&,
                                         const services::ServedDataset&, const Product& cached,
                                         const MakeProduct&);
/// The same for a kind of product that is made of nothing but the tile.
std::optional<http::Reply> serve_product(const http::Request&, http::DeferredReply&,
                                         const AskedTile&, services::TileProducts&);

}  // namespace tind::api
