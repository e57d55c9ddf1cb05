#include "server/api/ogc/tileset_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/api/crs_name.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/images/height_image.h"

namespace tind::api::ogc {
namespace {

using services::ServedDataset;

/// Around all that are available, level by level.
std::vector<TileLimits> mesh_limits(const ServedDataset& dataset) {
  std::vector<TileLimits> all;
  if (!dataset.tiles) return all;
  const auto& available = dataset.tiles->layer().available;
  for (int level = 0; level < int(available.size()); ++level) {
    std::optional<TileLimits> limits;
    for (const proto::TileRange& r : available[std::size_t(level)]) {
      const std::uint32_t north = flipped_row(level, r.end_y),
                          south = flipped_row(level, r.start_y);
      if (!limits) limits = TileLimits{level, north, south, r.start_x, r.end_x};
      *limits = {level, std::min(limits->min_row, north), std::max(limits->max_row, south),
                 std::min(limits->min_col, r.start_x), std::max(limits->max_col, r.end_x)};
    }
    if (limits) all.push_back(*limits);
  }
  return all;
}

/// By the bounds, which decide where images are, too.
std::vector<TileLimits> map_limits(const ServedDataset& dataset) {
  std::vector<TileLimits> all;
  if (!dataset.source || !has_images(*dataset.source)) return all;
  const GeoRect b = dataset.source->info().bounds;
  const int deepest = deepest_image_level(*dataset.source);
  for (int level = 0; level <= deepest; ++level) {
    const double side = std::ldexp(1., level);
    const auto index = [&](double share) {
      return std::uint32_t(std::clamp(std::floor(share * side), 0., side - 1));
    };
    all.push_back({level, index(web_mercator::v_of(b.north)), index(web_mercator::v_of(b.south)),
                   index(web_mercator::u_of(b.west)), index(web_mercator::u_of(b.east))});
  }
  return all;
}

Ordered limits_json(const std::vector<TileLimits>& limits) {
  Ordered all = Ordered::array();
  for (const TileLimits& l : limits)
    all.push_back({{"tileMatrix", std::to_string(l.level)},
                   {"minTileRow", l.min_row},
                   {"maxTileRow", l.max_row},
                   {"minTileCol", l.min_col},
                   {"maxTileCol", l.max_col}});
  return all;
}

std::string path_of(const ServedDataset& dataset, const TileMatrixSet& set) {
  return "/collections/" + dataset.name + "/tiles/" + set.id;
}

bool is_mesh(const TileMatrixSet& set) { return &set == &kWorldCrs84Quad; }

Ordered item_links(const Asked& asked, const ServedDataset& dataset, const TileMatrixSet& set) {
  const std::string tile = path_of(dataset, set) + "/{tileMatrix}/{tileRow}/{tileCol}";
  if (is_mesh(set))
    return Ordered::array({template_link(asked, tile, "item", "application/vnd.quantized-mesh",
                                         "a tile, quantized-mesh-1.0")});
  Ordered links = Ordered::array();
  struct Row {
    const char *query, *title;
  };
  for (const Row row : {Row{"?style=hillshade&f=", "hillshade"}, Row{"?style=slope&f=", "slope"},
                        Row{"?style=aspect&f=", "aspect"},
                        Row{"?style=mapbox&f=", "heights as colours, terrain-RGB"},
                        Row{"?style=terrarium&f=", "heights as colours, terrarium"}})
    for (const std::string form : {"png", "webp"})
      links.push_back(template_link(asked, tile + row.query + form, "item",
                                    form == "png" ? "image/png" : "image/webp", row.title));
  return links;
}

Ordered head_json(const ServedDataset& dataset, const TileMatrixSet& set) {
  const std::string what = is_mesh(set) ? "terrain as meshes" : "terrain as maps";
  return {{"title", dataset.name + ": " + what},
          {"dataType", is_mesh(set) ? "coverage" : "map"},
          {"crs", set.crs},
          {"tileMatrixSetURI", set.uri()}};
}

Ordered scheme_link(const Asked& asked, const TileMatrixSet& set) {
  return link(asked, std::string("/tileMatrixSets/") + set.id, kRelTilingScheme, kJson, set.title);
}

}  // namespace

std::vector<TileLimits> tile_limits(const ServedDataset& dataset, const TileMatrixSet& set) {
  return is_mesh(set) ? mesh_limits(dataset) : map_limits(dataset);
}

Ordered tileset_json(const Asked& asked, const ServedDataset& dataset, const TileMatrixSet& set) {
  const GeoRect b = dataset.facts().bounds;
  Ordered json = head_json(dataset, set);
  json["tileMatrixSetId"] = set.id;
  json["boundingBox"] = {{"lowerLeft", {b.west, b.south}},
                         {"upperRight", {b.east, b.north}},
                         {"crs", crs_uri("CRS84")}};
  json["tileMatrixSetLimits"] = limits_json(tile_limits(dataset, set));
  if (const std::string by = dataset.facts().attribution; !by.empty()) json["attribution"] = by;
  json["links"] = Ordered::array({scheme_link(asked, set)});
  for (Ordered& one : item_links(asked, dataset, set)) json["links"].push_back(std::move(one));
  return json;
}

Ordered tileset_item_json(const Asked& asked, const ServedDataset& dataset,
                          const TileMatrixSet& set) {
  Ordered json = head_json(dataset, set);
  json["links"] = Ordered::array(
      {link(asked, path_of(dataset, set), "self", kJson, json["title"]), scheme_link(asked, set)});
  return json;
}

}  // namespace tind::api::ogc
