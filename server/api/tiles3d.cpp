// /3dtiles/{dataset}/tileset.json, and the subtrees and tiles that it leads to.

#include <string>

#include "server/api/app.h"
#include "server/api/tile_address.h"
#include "server/api/tile_product.h"
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
                                   http::DeferredReply& deferred, std::string_view hemisphere) {
  auto tile = find_tile3d(app, request, hemisphere, kNoTile3d);
  if (!tile) return std::move(tile.error());
  return serve_product(request, deferred, *tile, app.tiles3d->contents);
}

std::optional<http::Reply> subtree(const App& app, const http::Request& request,
                                   http::DeferredReply& deferred, std::string_view hemisphere) {
  auto root = find_tile3d(app, request, hemisphere, kNoSubtree);
  if (!root) return std::move(root.error());
  if (root->id.level % tiles3d::kSubtreeLevels != 0) return no_tile(request, kNoSubtree);
  return serve_product(request, deferred, *root, app.tiles3d->subtrees);
}

std::optional<http::Reply> tileset(const App& app, const http::Request& request,
                                   http::DeferredReply& deferred) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::move(not_found);
  if (!dataset->tiles) return no_tiles(request);
  if (const auto roots = tiles3d::has_roots(*dataset->tiles); !roots)
    return no_tile(request, roots.error().what);
  return serve_product(request, deferred, {std::move(dataset), TileId{}}, app.tiles3d->tilesets);
}

}  // namespace

void add_tiles3d_routes(http::Router& router, const App& app) {
  if (!app.tiles3d) return;
  router.get("/3dtiles/{dataset}/tileset.json",
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return tileset(app, request, deferred);
             });
  for (const std::string hemisphere : {"west", "east"}) {
    const std::string tile = "/3dtiles/{dataset}/" + hemisphere + "/{z}/{x}/{y}";
    router.get(tile + ".glb",
               [&app, hemisphere](const http::Request& request, http::DeferredReply& deferred) {
                 return content(app, request, deferred, hemisphere);
               });
    router.get(tile + ".subtree",
               [&app, hemisphere](const http::Request& request, http::DeferredReply& deferred) {
                 return subtree(app, request, deferred, hemisphere);
               });
  }
}

}  // namespace tind::api
