#pragma once
// What the resources of web maps have in common: /{resource}/{dataset}/tiles.json and
// /{resource}/{dataset}/{z}/{x}/{y}.png or .webp, rows from the north.

#include <cstdint>
#include <expected>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/api/app.h"
#include "server/http/operation.h"
#include "server/services/tiles/tile_products.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/images/image_tile.h"

namespace tind::api {

/// "https://maps.example": where the client asked, for addresses that must be absolute. Empty where
/// an old client (HTTP/1.0) does not say.
std::string origin_of(const http::Request&);

/// The dataset that the path names, which has its DEM; or the 404.
std::expected<std::shared_ptr<const services::ServedDataset>, http::Reply> find_with_source(
    const App&, const http::Request&);
/// And which lies, if only in part, where web maps do.
std::expected<std::shared_ptr<const services::ServedDataset>, http::Reply> find_mapped(
    const App&, const http::Request&);

/// The tile that the rest of the path names; or the 404 where the dataset has none there.
std::expected<web_mercator::Tile, http::Reply> find_web_tile(const services::ServedDataset&,
                                                             const http::Request&);
std::expected<web_mercator::Tile, http::Reply> find_web_tile(
    const http::Request&, const std::function<bool(web_mercator::Tile)>& has);

/// The tile of that detail, from the cache or made. REQUIRES: find_web_tile() of the dataset.
std::optional<http::Reply> serve_image(const http::Request&, http::DeferredReply&,
                                       services::TileProducts&, const services::ServedDataset&,
                                       web_mercator::Tile, std::uint32_t detail);

/// What tiles are asked with to get past caches.
inline const http::QueryWord kVersionWord = {.name = "v",
                                             .words = {},
                                             .fits = [](std::string_view) { return true; },
                                             .form = "anything",
                                             .about = "a version: counts for nothing here",
                                             .pattern = "^[A-Za-z0-9]{1,16}$"};

/// Of tiles, `id` with the format after it; of their description, whose last word is `format`:
/// which of the formats its tiles are to have.
http::Operation image_operation(const char* id, const char* summary, proto::ImageFormat,
                                std::vector<http::QueryWord>);
http::Operation tile_json_operation(const char* id, const char* summary,
                                    std::vector<http::QueryWord>);

/// `json` with the address of its tiles. `query`: what tiles are asked with, "a=b&c=d".
http::Reply tile_json_reply(const http::Request&, const services::ServedDataset&, proto::TileJson,
                            const std::string& resource, const std::string& query);

}  // namespace tind::api
