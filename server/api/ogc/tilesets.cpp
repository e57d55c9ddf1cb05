// /collections/{id}/tiles, one tileset of it, and its tiles (OGC API - Tiles, Part 1, 20-057): the
// same bytes as /terrain, /shade and /rgb send. Row before column, rows from the north.

#include <nlohmann/json.hpp>
#include <string>

#include "server/api/extensions.h"
#include "server/api/ogc/routes.h"
#include "server/api/ogc/tileset_json.h"
#include "server/api/responses.h"
#include "server/api/tiles/tile_address.h"
#include "server/api/tiles/tile_product.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/problem.h"
#include "terrain/images/height_image.h"

namespace tind::api::ogc {
namespace {

using Found = std::shared_ptr<const services::ServedDataset>;

http::Reply no_tileset(const http::Request& request) {
  return http::problem_reply({.status = 404,
                              .detail = "The collection has no such tileset; its /tiles lists all.",
                              .instance = request.head.target});
}

/// Not there because of the address: 404. Within the limits, but without data: nothing to send.
http::Reply no_tile_there(const http::Request& request, const std::vector<TileLimits>& all,
                          int level, std::uint32_t col, std::uint32_t row) {
  for (const TileLimits& limits : all)
    if (limits.level == level && limits.hold(col, row))
      return http::make_reply(204, {}, {}, {{"Cache-Control", "no-cache"}});
  return no_tile(request, "There is no such tile; the tileset says which exist.");
}

std::optional<http::Reply> list(const App& app, const http::Request& request) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto asked = read_asked(request);
  if (!asked) return asked.error();
  Ordered all = Ordered::array();
  if (dataset->tiles) all.push_back(tileset_item_json(*asked, *dataset, kWorldCrs84Quad));
  if (app.images && dataset->source && has_images(*dataset->source))
    all.push_back(tileset_item_json(*asked, *dataset, kWebMercatorQuad));
  return document_reply(*asked,
                        {{"title", dataset->name + ": tiles"}, {"tilesets", std::move(all)}});
}

std::optional<http::Reply> tileset(const App& app, const http::Request& request) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const TileMatrixSet* const set = tile_matrix_set(request.matched[1]);
  const bool there = set == &kWorldCrs84Quad
                         ? bool(dataset->tiles)
                         : set && app.images && dataset->source && has_images(*dataset->source);
  if (!there) return no_tileset(request);
  const auto asked = read_asked(request);
  if (!asked) return asked.error();
  return document_reply(*asked, tileset_json(*asked, *dataset, *set));
}

std::optional<http::Reply> mesh_tile(const App& app, const http::Request& request,
                                     http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->tiles) return no_tileset(request);
  const auto turned = tile_address(request.matched[1], request.matched[3], request.matched[2]);
  if (!turned) return no_tile_there(request, {}, 0, 0, 0);
  const TileId id = *tiling::tile(turned->level, turned->x, flipped_row(turned->level, turned->y));
  if (!dataset->has(id))
    return no_tile_there(request, tile_limits(*dataset, kWorldCrs84Quad), turned->level, turned->x,
                         turned->y);
  const proto::Extensions asked = asked_extensions(request.head.fields, request.head.query);
  return serve_product(request, deferred, *dataset, app.tiles.cached(*dataset, id, asked),
                       [&](services::TileProducts::Done done, http::Asker asker) {
                         app.tiles.make(*dataset, id, asked, std::move(done), std::move(asker));
                       });
}

std::optional<http::Reply> map_tile(const App& app, const http::Request& request,
                                    http::DeferredReply& deferred) {
  const auto dataset = find_mapped(app, request);
  if (!dataset) return dataset.error();
  const auto query = http::read_query(request);
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  const auto tile = web_tile_address(request.matched[1], request.matched[3], request.matched[2]);
  if (!tile) return no_tile_there(request, {}, 0, 0, 0);
  if (!has_image(*(*dataset)->source, *tile))
    return no_tile_there(request, tile_limits(**dataset, kWebMercatorQuad), tile->level, tile->x,
                         tile->y);
  const std::string& style = query.words[0];
  const auto format =
      enum_named<proto::ImageFormat>(query.words[1]).value_or(proto::ImageFormat::png);
  if (const auto code = proto::height_code_named(style))
    return serve_image(request, deferred, app.images->heights(), **dataset, *tile,
                       services::AskedHeights{*code, format}.number());
  services::AskedShade shade;
  shade.style = shade_style_named(style).value_or(ShadeStyle::hillshade);
  shade.format = format;
  return serve_image(request, deferred, app.images->shades(), **dataset, *tile, shade.number());
}

constexpr const char* kTilesets = R"({
  "type": "object",
  "required": ["tilesets"],
  "properties": {"title": {"type": "string"},
                 "tilesets": {"type": "array", "items": {"type": "object"}},
                 "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";
constexpr const char* kTileset = R"({
  "type": "object",
  "required": ["dataType", "crs", "links"],
  "properties": {
    "title": {"type": "string"}, "dataType": {"type": "string"}, "crs": {"type": "string"},
    "description": {"type": "string"}, "attribution": {"type": "string"},
    "tileMatrixSetURI": {"type": "string"}, "tileMatrixSetId": {"type": "string"},
    "tileMatrixSetLimits": {"type": "array"}, "boundingBox": {"type": "object"},
    "centerPoint": {"type": "object"}, "layers": {"type": "array"}, "accessConstraints": {},
    "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";

const http::Response kNothingThere = {204, "Within the limits of the tileset, without data."};

http::Operation mesh_operation() {
  http::Operation operation = {
      .id = "getCollectionMeshTile",
      .tag = "OGC",
      .summary = "A tile as quantized-mesh, rows from the north",
      .scope = http::Scope::tiles,
      .ignores_others = true,
      .responses = resource("The tile.", "application/vnd.quantized-mesh")};
  operation.responses.push_back(kNothingThere);
  return operation;
}

http::Operation map_operation() {
  return {.id = "getCollectionMapTile",
          .tag = "OGC",
          .summary = "A tile of a web map",
          .scope = http::Scope::tiles,
          .words = {{.name = "style",
                     .words = {"hillshade", "slope", "aspect", "mapbox", "terrarium"},
                     .about = "what is drawn"},
                    {.name = "f", .words = {"png", "webp"}}},
          .responses = {{200, "The tile.", {{"image/png"}, {"image/webp"}}},
                        kNothingThere,
                        {304, "The client has it already (If-None-Match)."}}};
}

}  // namespace

void add_tileset_routes(http::Router& router, const App& app) {
  const std::string tiles = "/collections/{collectionId}/tiles",
                    tile = "/{tileMatrix}/{tileRow}/{tileCol}";
  router.get(tiles + "/WorldCRS84Quad" + tile, mesh_operation(),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return mesh_tile(app, request, deferred);
             });
  if (app.images)
    router.get(tiles + "/WebMercatorQuad" + tile, map_operation(),
               [&app](const http::Request& request, http::DeferredReply& deferred) {
                 return map_tile(app, request, deferred);
               });
  router.get(
      tiles, document_operation("getTilesets", "The tilesets of a dataset", kTilesets),
      [&app](const http::Request& request, http::DeferredReply&) { return list(app, request); });
  router.get(
      tiles + "/{tileMatrixSetId}",
      document_operation("getTileset", "A tileset: which tiles there are", kTileset),
      [&app](const http::Request& request, http::DeferredReply&) { return tileset(app, request); });
}

}  // namespace tind::api::ogc
