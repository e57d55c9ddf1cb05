// /rgb/{dataset}/tiles.json and /rgb/{dataset}/{z}/{x}/{y}.png: heights as colours, for clients of
// terrain-RGB. Rows are counted from the north here, as web maps do.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/app.h"
#include "server/api/tile_address.h"
#include "server/api/tile_product.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"
#include "terrain/base/hash.h"
#include "terrain/images/height_image.h"

namespace tind::api {
namespace {

using services::HeightImages;

constexpr std::string_view kNoImage =
    "There is no such tile; tiles.json says which exist. Rows are counted from the north.";

const http::QueryWord kWords[] = {{"encoding", {"mapbox", "terrarium"}},
                                  {"v", {}, [](std::string_view) { return true; }, "anything"}};

std::optional<http::Reply> image(const App& app, const http::Request& request,
                                 http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->source) return no_source(request);
  const auto query = http::read_numbers(request.head.query, {}, kWords);
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  const auto tile = web_tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!tile || !has_image(*dataset->source, *tile)) return no_tile(request, kNoImage);
  const auto code = proto::height_code_named(query.words[0]).value_or(proto::HeightCode::mapbox);
  services::TileProducts& images = app.images->of(code);
  const TileId address = HeightImages::address(*tile);
  return serve_product(request, deferred, images.cached(*dataset, address),
                       [&](services::TileProducts::Done done, std::stop_token gone) {
                         images.make(*dataset, address, std::move(done), std::move(gone));
                       });
}

/// Where the client asked: MapLibre takes absolute addresses only.
std::string origin_of(const http::Request& request) {
  const bool secure = request.head.fields.find("x-forwarded-proto") == "https";
  return (secure ? "https://" : "http://") + std::string(request.head.host);
}

nlohmann::ordered_json tile_json(const services::ServedDataset& dataset, proto::HeightCode code,
                                 const std::string& origin) {
  const Surface& surface = *dataset.source;
  const GeoRect& b = surface.info().bounds;
  const double most = web_mercator::rect({0, 0, 0}).north;
  const double south = std::clamp(b.south, -most, most), north = std::clamp(b.north, -most, most);
  const std::string version = hash128(surface.info().fingerprint).text().substr(0, 12);
  const std::string encoding(proto::name(code));
  const int deepest = deepest_image_level(surface);
  nlohmann::ordered_json json = {
      {"tilejson", "3.0.0"},
      {"name", dataset.name},
      {"tiles",
       {origin + "/rgb/" + dataset.name + "/{z}/{x}/{y}.png?encoding=" + encoding +
        "&v=" + version}},
      {"scheme", "xyz"},
      {"minzoom", 0},
      {"maxzoom", deepest},
      {"bounds", {b.west, south, b.east, north}},
      {"center", {(b.west + b.east) / 2, (south + north) / 2, std::max(0, deepest - 2)}},
      {"tileSize", kImagePixels},
      {"encoding", encoding},
      {"format", "png"},
      {"datum", name(surface.info().datum)},
      {"height_step_m", proto::height_step_m(code)}};
  if (const std::string attribution = dataset.facts().attribution; !attribution.empty())
    json["attribution"] = attribution;
  return json;
}

std::optional<http::Reply> tiles_json(const App& app, const http::Request& request) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->source) return no_source(request);
  const auto query = http::read_numbers(request.head.query, {}, kWords);
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  const auto code = proto::height_code_named(query.words[0]).value_or(proto::HeightCode::mapbox);
  return http::make_reply(200, "application/json",
                          tile_json(*dataset, code, origin_of(request)).dump() + "\n",
                          {{"Cache-Control", "no-cache"}, {"Vary", "Host, X-Forwarded-Proto"}});
}

}  // namespace

void add_height_image_routes(http::Router& router, const App& app) {
  if (!app.images) return;
  router.get("/rgb/{dataset}/{z}/{x}/{y}.png",
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return image(app, request, deferred);
             });
  router.get("/rgb/{dataset}/tiles.json",
             [&app](const http::Request& request, http::DeferredReply&) {
               return tiles_json(app, request);
             });
}

}  // namespace tind::api
