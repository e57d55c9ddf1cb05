// /rgb/{dataset}/tiles.json and /rgb/{dataset}/{z}/{x}/{y}.png or .webp: heights as colours, for
// clients of terrain-RGB.

#include <optional>
#include <span>
#include <string>

#include "server/api/app.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"
#include "terrain/images/mesh_image.h"

namespace tind::api {
namespace {

using services::AskedHeights;

const std::vector<http::QueryWord> kWords = {
    {.name = "encoding", .words = {"mapbox", "terrarium"}, .about = "of heights as colours"},
    {.name = "surface", .words = {"source", "mesh"}, .about = "the DEM, or the tiles' meshes"},
    kVersionWord};

/// `format`: as the path says it; nothing: the query may.
std::expected<AskedHeights, http::Reply> heights_of(const http::Request& request,
                                                    std::optional<proto::ImageFormat> format) {
  const auto query = http::read_query(request);
  if (!query.problems.empty())
    return std::unexpected(http::problem_reply(query.problems, request.head.target));
  if (!format) format = enum_named<proto::ImageFormat>(query.words[3]);
  return AskedHeights{proto::height_code_named(query.words[0]).value_or(proto::HeightCode::mapbox),
                      format.value_or(proto::ImageFormat::png), query.words[1] == "mesh"};
}

/// Of the surface that is asked for: the dataset with a DEM, or with tiles; or the 404.
std::expected<std::shared_ptr<const services::ServedDataset>, http::Reply> find_surface(
    const App& app, const http::Request& request, bool of_mesh) {
  if (!of_mesh) return find_mapped(app, request);
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::unexpected(std::move(not_found));
  if (!dataset->tiles) return std::unexpected(no_tiles(request));
  return dataset;
}

std::optional<http::Reply> image(const App& app, proto::ImageFormat format,
                                 const http::Request& request, http::DeferredReply& deferred) {
  const auto asked = heights_of(request, format);
  const auto dataset = find_surface(app, request, asked && asked->of_mesh);
  if (!dataset) return dataset.error();
  if (!asked) return asked.error();
  const auto tile = asked->of_mesh
                        ? find_web_tile(request,
                                        [&](web_mercator::Tile t) {
                                          return has_mesh_image((*dataset)->tiles->layer(), t);
                                        })
                        : find_web_tile(**dataset, request);
  if (!tile) return tile.error();
  return serve_image(request, deferred, app.images->heights(), **dataset, *tile, asked->number());
}

std::optional<http::Reply> tiles_json(const App& app, const http::Request& request) {
  const auto asked = heights_of(request, {});
  const auto dataset = find_surface(app, request, asked && asked->of_mesh);
  if (!dataset) return dataset.error();
  if (!asked) return asked.error();
  const services::ServedDataset& found = **dataset;
  const std::string query = "encoding=" + std::string(proto::name(asked->code));
  if (asked->of_mesh) {
    const proto::LayerJson& layer = found.tiles->layer();
    return tile_json_reply(request, found,
                           mesh_tile_json(layer, asked->code, asked->format, found.name), "rgb",
                           query + "&surface=mesh&v=" + layer.version);
  }
  return tile_json_reply(
      request, found,
      image_tile_json(*found.source, asked->kind(), found.name, found.facts().attribution), "rgb",
      query + "&v=" + image_version(*found.source));
}

}  // namespace

void add_height_image_routes(http::Router& router, const App& app) {
  if (!app.images) return;
  for (const auto format : {proto::ImageFormat::png, proto::ImageFormat::webp})
    router.get("/rgb/{dataset}/{z}/{x}/{y}." + name_of(format),
               image_operation("getHeightImage", "Heights as colours", format, kWords),
               [&app, format](const http::Request& request, http::DeferredReply& deferred) {
                 return image(app, format, request, deferred);
               });
  router.get("/rgb/{dataset}/tiles.json",
             tile_json_operation("getHeightImages", "TileJSON of heights as colours", kWords),
             [&app](const http::Request& request, http::DeferredReply&) {
               return tiles_json(app, request);
             });
}

}  // namespace tind::api
