// /3dtiles/{dataset}/tileset.json, and the subtrees and tiles that it leads to; the same compressed
// below /3dtiles/{dataset}/meshopt.

#include <string>

#include "server/api/app.h"
#include "server/api/responses.h"
#include "server/api/tiles/tile_address.h"
#include "server/api/tiles/tile_product.h"
#include "terrain/tiles3d/tileset.h"

namespace tind::api {
namespace {

constexpr std::string_view kNoTile3d =
    "There is no such tile; tileset.json and its subtrees say which exist.";
constexpr std::string_view kNoSubtree =
    "No subtree begins there; tileset.json and the subtrees above say which exist.";

/// What a path names, {dataset}/west/{z}/{x}/{y} or east.
std::expected<AskedTile, http::Reply> find_tile3d(const App& app, const http::Request& request,
                                                  std::string_view hemisphere,
                                                  std::string_view detail) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::unexpected(std::move(not_found));
  const auto id =
      tile3d_address(hemisphere, request.matched[1], request.matched[2], request.matched[3]);
  if (!id || !dataset->has(*id)) return std::unexpected(no_tile(request, detail));
  return AskedTile{std::move(dataset), *id};
}

std::optional<http::Reply> content(const App& app, const http::Request& request,
                                   http::DeferredReply& deferred, std::string_view hemisphere,
                                   services::Tileset3d& set) {
  auto tile = find_tile3d(app, request, hemisphere, kNoTile3d);
  if (!tile) return std::move(tile.error());
  return serve_product(request, deferred, *tile, set.contents);
}

std::optional<http::Reply> subtree(const App& app, const http::Request& request,
                                   http::DeferredReply& deferred, std::string_view hemisphere,
                                   services::Tileset3d& set) {
  auto root = find_tile3d(app, request, hemisphere, kNoSubtree);
  if (!root) return std::move(root.error());
  if (root->id.level % tiles3d::kSubtreeLevels != 0) return no_tile(request, kNoSubtree);
  return serve_product(request, deferred, *root, set.subtrees);
}

std::optional<http::Reply> tileset(const App& app, const http::Request& request,
                                   http::DeferredReply& deferred, services::Tileset3d& set) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::move(not_found);
  if (!dataset->tiles) return no_tiles(request);
  if (const auto roots = tiles3d::has_roots(*dataset->tiles); !roots)
    return no_tile(request, roots.error().what);
  return serve_product(request, deferred, {std::move(dataset), TileId{}}, set.tilesets);
}

http::Operation operation_of(const std::string& id, const char* summary, const char* type) {
  return {.id = id,
          .tag = "Tiles",
          .summary = summary,
          .scope = http::Scope::tiles,
          .ignores_others = true,
          .responses = resource("It.", type,
                                std::string_view(type) == "application/json" ? R"({"type": "object",
                                          "required": ["asset", "geometricError", "root"],
                                          "properties": {"asset": {"type": "object"},
                                            "geometricError": {"type": "number"},
                                            "root": {"type": "object"},
                                            "schema": {"type": "object"},
                                            "statistics": {"type": "object"},
                                            "metadata": {"type": "object"},
                                            "extensionsUsed": {"type": "array"},
                                            "extensionsRequired": {"type": "array"},
                                            "extras": {"type": "object"}}})"
                                                                             : "")};
}

/// `kind`: "" or "Meshopt", for names.
void add_routes(http::Router& router, const App& app, const std::string& base,
                services::Tileset3d& set, const std::string& kind) {
  router.get(base + "tileset.json",
             operation_of("get3dTileset" + kind, "The tiles as 3D Tiles 1.1", "application/json"),
             [&app, &set](const http::Request& request, http::DeferredReply& deferred) {
               return tileset(app, request, deferred, set);
             });
  for (const std::string hemisphere : {"west", "east"}) {
    const std::string tile = base + hemisphere + "/{z}/{x}/{y}", id = kind + "_" + hemisphere;
    router.get(
        tile + ".glb", operation_of("get3dTile" + id, "One tile of 3D Tiles", "model/gltf-binary"),
        [&app, &set, hemisphere](const http::Request& request, http::DeferredReply& deferred) {
          return content(app, request, deferred, hemisphere, set);
        });
    router.get(
        tile + ".subtree",
        operation_of("get3dSubtree" + id, "Which tiles there are below one",
                     "application/octet-stream"),
        [&app, &set, hemisphere](const http::Request& request, http::DeferredReply& deferred) {
          return subtree(app, request, deferred, hemisphere, set);
        });
  }
}

}  // namespace

void add_tiles3d_routes(http::Router& router, const App& app) {
  if (!app.tiles3d) return;
  add_routes(router, app, "/3dtiles/{dataset}/", app.tiles3d->plain, "");
  add_routes(router, app, "/3dtiles/{dataset}/meshopt/", app.tiles3d->meshopt, "Meshopt");
}

}  // namespace tind::api
