#include "server/api/tiles/web_map.h"

#include "server/api/responses.h"
#include "server/api/tiles/tile_address.h"
#include "server/api/tiles/tile_product.h"
#include "server/http/message/problem.h"
#include "terrain/images/height_image.h"

namespace tind::api {
namespace {

constexpr std::string_view kNoImage =
    "There is no such tile; tiles.json says which exist. Rows are counted from the north.";

}  // namespace

/// MapLibre takes absolute addresses only.
std::string origin_of(const http::Request& request) {
  if (request.head.host.empty()) return {};
  const bool secure = request.head.fields.find("x-forwarded-proto") == "https";
  return (secure ? "https://" : "http://") + std::string(request.head.host);
}

std::expected<std::shared_ptr<const services::ServedDataset>, http::Reply> find_with_source(
    const App& app, const http::Request& request) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::unexpected(std::move(not_found));
  if (!dataset->source) return std::unexpected(no_source(request));
  return dataset;
}

std::expected<std::shared_ptr<const services::ServedDataset>, http::Reply> find_mapped(
    const App& app, const http::Request& request) {
  auto dataset = find_with_source(app, request);
  if (dataset && !has_images(*(*dataset)->source))
    return std::unexpected(no_tile(request,
                                   "Web maps end at 85.05 degrees, and this dataset lies beyond "
                                   "them: it has meshes and heights, but no images."));
  return dataset;
}

std::expected<web_mercator::Tile, http::Reply> find_web_tile(
    const http::Request& request, const std::function<bool(web_mercator::Tile)>& has) {
  const auto tile = web_tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!tile || !has(*tile)) return std::unexpected(no_tile(request, kNoImage));
  return *tile;
}

std::expected<web_mercator::Tile, http::Reply> find_web_tile(const services::ServedDataset& dataset,
                                                             const http::Request& request) {
  return find_web_tile(request,
                       [&](web_mercator::Tile tile) { return has_image(*dataset.source, tile); });
}

std::optional<http::Reply> serve_image(const http::Request& request, http::DeferredReply& deferred,
                                       services::TileProducts& images,
                                       const services::ServedDataset& dataset,
                                       web_mercator::Tile tile, std::uint32_t detail) {
  const TileId address = services::HeightImages::address(tile);
  return serve_product(request, deferred, dataset, images.cached_detailed(dataset, address, detail),
                       [&](services::TileProducts::Done done, http::Asker asker) {
                         images.make_detailed(dataset, address, detail, std::move(done),
                                              std::move(asker));
                       });
}

http::Operation image_operation(const char* id, const char* summary, proto::ImageFormat format,
                                std::vector<http::QueryWord> words) {
  return {.id = id + ("As_" + name_of(format)),
          .tag = "Images",
          .summary = summary,
          .scope = http::Scope::tiles,
          .words = std::move(words),
          .responses = resource("The image.", std::string(media_type(format)))};
}

http::Operation tile_json_operation(const char* id, const char* summary,
                                    std::vector<http::QueryWord> words) {
  words.push_back({.name = "format", .words = {"png", "webp"}, .about = "of the tiles"});
  return {.id = id,
          .tag = "Images",
          .summary = summary,
          .scope = http::Scope::tiles,
          .words = std::move(words),
          .responses = json_answer("TileJSON 3.", R"({
            "type": "object",
            "required": ["tilejson", "tiles"],
            "properties": {
              "tilejson": {"const": "3.0.0"}, "name": {"type": "string"},
              "tiles": {"type": "array", "items": {"type": "string"}},
              "scheme": {"const": "xyz"}, "minzoom": {"type": "integer"},
              "maxzoom": {"type": "integer"}, "bounds": {"type": "array"},
              "center": {"type": "array"}, "tileSize": {"type": "integer"},
              "encoding": {"type": "string"}, "format": {"type": "string"},
              "accuracy": {"type": "object"}, "attribution": {"type": "string"},
              "datum": {"type": "string"}, "style": {"type": "string"},
              "surface": {"type": "string"}, "height_step_m": {"type": "number"}
            }})")};
}

http::Reply tile_json_reply(const http::Request& request, const services::ServedDataset& dataset,
                            proto::TileJson json, const std::string& resource,
                            const std::string& query) {
  json.tiles = origin_of(request) + "/" + resource + "/" + dataset.name + "/{z}/{x}/{y}." +
               json.format + "?" + query;
  return http::make_reply(200, "application/json", proto::encode_tile_json(json),
                          {{"Cache-Control", "no-cache"}, {"Vary", "Host, X-Forwarded-Proto"}});
}

}  // namespace tind::api
