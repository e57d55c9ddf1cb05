// /terrain/{dataset}/layer.json and /terrain/{dataset}/{z}/{x}/{y}.terrain: a cached tile is
// answered at once, on the I/O thread; any other goes through the CPU pool.

#include <utility>

#include "server/api/app.h"
#include "server/api/extensions.h"
#include "server/api/responses.h"
#include "server/api/tiles/tile_product.h"

namespace tind::api {
namespace {

std::optional<http::Reply> tile(const App& app, const http::Request& request,
                                http::DeferredReply& deferred) {
  auto found = find_tile(app, request);
  if (!found) return std::move(found.error());
  const services::ServedDataset& dataset = *found->dataset;
  const proto::Extensions asked = asked_extensions(request.head.fields, request.head.query);
  return serve_product(request, deferred, dataset, app.tiles.cached(dataset, found->id, asked),
                       [&](services::TileProducts::Done done, http::Asker asker) {
                         app.tiles.make(dataset, found->id, asked, std::move(done),
                                        std::move(asker));
                       });
}

std::optional<http::Reply> layer_json(const App& app, const http::Request& request) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->tiles) return no_tiles(request);
  return dataset->layer_json->reply(request.head.fields);
}

const http::Operation kTile = {
    .id = "getTile",
    .tag = "Tiles",
    .summary = "One tile as quantized-mesh-1.0",
    .about =
        "EPSG:4326, rows from the south. Without vertex normals, metadata and water mask, "
        "unless `extensions` or `Accept` asks for them.",
    .scope = http::Scope::tiles,
    .words = {{.name = "extensions",
               .words = {},
               .form = "names with - between",
               .about = "which extensions the tile is to have; names that are not known count for "
                        "nothing",
               .pattern = "^(octvertexnormals|metadata|watermask)"
                          "(-(octvertexnormals|metadata|watermask)){0,2}$",
               .example = "octvertexnormals-metadata"}},
    .ignores_others = true,
    .responses = resource("The tile.", "application/vnd.quantized-mesh")};

const http::Operation kLayerJson = {
    .id = "getLayerJson",
    .tag = "Tiles",
    .summary = "What globe clients read first: which tiles there are",
    .scope = http::Scope::tiles,
    .ignores_others = true,
    .responses = resource("layer.json.", "application/json", R"({
      "type": "object",
      "required": ["tilejson", "format", "tiles", "available"],
      "properties": {
        "tilejson": {"type": "string"}, "name": {"type": "string"},
        "description": {"type": "string"}, "attribution": {"type": "string"},
        "version": {"type": "string"}, "format": {"type": "string"}, "scheme": {"type": "string"},
        "projection": {"type": "string"}, "tiles": {"type": "array", "items": {"type": "string"}},
        "bounds": {"type": "array", "items": {"type": "number"}},
        "minzoom": {"type": "integer"}, "maxzoom": {"type": "integer"},
        "extensions": {"type": "array", "items": {"type": "string"}},
        "available": {"type": "array"}, "metadataAvailability": {"type": "integer"},
        "side": {"type": "string"}, "datum": {"type": "string"},
        "accuracy": {"type": "object"}
      }})")};

}  // namespace

void add_tile_routes(http::Router& router, const App& app) {
  router.get("/terrain/{dataset}/{z}/{x}/{y}.terrain", kTile,
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return tile(app, request, deferred);
             });
  router.get("/terrain/{dataset}/layer.json", kLayerJson,
             [&app](const http::Request& request, http::DeferredReply&) {
               return layer_json(app, request);
             });
}

}  // namespace tind::api
