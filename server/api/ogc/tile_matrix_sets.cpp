// /tileMatrixSets: how tiles are cut, for clients that do not know.

#include "server/api/ogc/tile_matrix_sets.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "server/api/ogc/routes.h"
#include "server/http/message/problem.h"
#include "terrain/geo/web_mercator.h"

namespace tind::api::ogc {
namespace {

constexpr int kTileCells = 256;
constexpr double kPixel_m = 0.28e-3;  // of a screen, by which scales are said
constexpr double kHalfEarth_m = web_mercator::kEarthM / 2;

Ordered matrix_json(const TileMatrixSet& set, int level) {
  const double cell = std::ldexp(set.cell_size, -level);
  const std::int64_t rows = std::int64_t(1) << level;
  return {{"id", std::to_string(level)},
          {"scaleDenominator", cell * set.metres / kPixel_m},
          {"cellSize", cell},
          {"cornerOfOrigin", "topLeft"},
          {"pointOfOrigin", {set.origin[0], set.origin[1]}},
          {"tileWidth", kTileCells},
          {"tileHeight", kTileCells},
          {"matrixWidth", set.first_columns * rows},
          {"matrixHeight", rows}};
}

Ordered set_json(const TileMatrixSet& set) {
  Ordered json = {
      {"id", set.id},
      {"title", set.title},
      {"uri", set.uri()},
      {"crs", set.crs},
      {"orderedAxes", &set == &kWorldCrs84Quad ? Ordered{"Lon", "Lat"} : Ordered{"X", "Y"}},
      {"tileMatrices", Ordered::array()}};
  for (int level = 0; level <= set.max_level; ++level)
    json["tileMatrices"].push_back(matrix_json(set, level));
  return json;
}

Ordered list_json(const Asked& asked) {
  Ordered all = Ordered::array();
  for (const TileMatrixSet* set : {&kWorldCrs84Quad, &kWebMercatorQuad})
    all.push_back({{"id", set->id},
                   {"title", set->title},
                   {"uri", set->uri()},
                   {"crs", set->crs},
                   {"links", Ordered::array({link(asked, std::string("/tileMatrixSets/") + set->id,
                                                  "self", kJson, set->title)})}});
  return {{"title", "Tile matrix sets"}, {"tileMatrixSets", std::move(all)}};
}

constexpr const char* kList = R"({
  "type": "object",
  "required": ["tileMatrixSets"],
  "properties": {"title": {"type": "string"},
                 "tileMatrixSets": {"type": "array", "items": {"type": "object"}},
                 "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";
constexpr const char* kSet = R"({
  "type": "object",
  "required": ["id", "crs", "tileMatrices"],
  "properties": {
    "id": {"type": "string"}, "title": {"type": "string"}, "uri": {"type": "string"},
    "crs": {"type": "string"}, "orderedAxes": {"type": "array"},
    "tileMatrices": {"type": "array", "items": {"type": "object"}},
    "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";

}  // namespace

const TileMatrixSet kWorldCrs84Quad = {
    "WorldCRS84Quad",
    "Longitudes and latitudes of the whole globe, two tiles at level 0",
    "http://www.opengis.net/def/crs/OGC/1.3/CRS84",
    2,
    180. / kTileCells,
    web_mercator::kEarthM / 360,
    {-180, 90},
    tiling::kMaxLevel};
const TileMatrixSet kWebMercatorQuad = {"WebMercatorQuad",
                                        "The square of web maps, one tile at level 0",
                                        "http://www.opengis.net/def/crs/EPSG/0/3857",
                                        1,
                                        web_mercator::kEarthM / kTileCells,
                                        1,
                                        {-kHalfEarth_m, kHalfEarth_m},
                                        web_mercator::kMaxLevel};

std::string TileMatrixSet::uri() const {
  return std::string("http://www.opengis.net/def/tilematrixset/OGC/1.0/") + id;
}

const TileMatrixSet* tile_matrix_set(std::string_view id) {
  for (const TileMatrixSet* set : {&kWorldCrs84Quad, &kWebMercatorQuad})
    if (id == set->id) return set;
  return nullptr;
}

void add_tile_matrix_set_routes(http::Router& router) {
  router.get("/tileMatrixSets", document_operation("getTileMatrixSets", "How tiles are cut", kList),
             [](const http::Request& request, http::DeferredReply&) -> std::optional<http::Reply> {
               const auto asked = read_asked(request);
               if (!asked) return asked.error();
               return document_reply(*asked, list_json(*asked));
             });
  router.get("/tileMatrixSets/{tileMatrixSetId}",
             document_operation("getTileMatrixSet", "One way in which tiles are cut", kSet),
             [](const http::Request& request, http::DeferredReply&) -> std::optional<http::Reply> {
               const TileMatrixSet* const set = tile_matrix_set(request.matched[0]);
               if (!set)
                 return http::problem_reply(
                     {.status = 404,
                      .detail = "There is no such tile matrix set; /tileMatrixSets lists all.",
                      .instance = request.head.target});
               const auto asked = read_asked(request);
               if (!asked) return asked.error();
               return document_reply(*asked, set_json(*set));
             });
}

}  // namespace tind::api::ogc
