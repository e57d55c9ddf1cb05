#include "terrain/images/mesh_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "terrain/geo/availability.h"
#include "terrain/geo/extent_box.h"
#include "terrain/images/height_image.h"
#include "terrain/store/layer_place.h"

namespace tind {
namespace {

std::vector<Geographic> centres(web_mercator::Tile tile, int pixels) {
  const double side = 1. / double(std::uint64_t(1) << tile.level) / pixels;  // of the map's
  std::vector<Geographic> places;
  places.reserve(std::size_t(pixels) * std::size_t(pixels));
  for (int y = 0; y < pixels; ++y) {
    const double lat = web_mercator::lat_of((tile.y * double(pixels) + y + .5) * side);
    for (int x = 0; x < pixels; ++x)
      places.push_back({web_mercator::lon_of((tile.x * double(pixels) + x + .5) * side), lat});
  }
  return places;
}

GeoRect bounds_of(const proto::LayerJson& layer) {
  const auto& [west, south, east, north] = layer.bounds;
  const double most = web_mercator::rect({0, 0, 0}).north;
  return {west, std::clamp(south, -most, most), east, std::clamp(north, -most, most)};
}

int deepest_level(const proto::LayerJson& layer) {
  return std::clamp(layer.maxzoom, 0, web_mercator::kMaxLevel);
}

/// The first level from `level` on that has tiles: images of those above it show nothing, but lead
/// to the others.
int level_with_tiles(const proto::LayerJson& layer, int level) {
  const auto& all = layer.available;
  for (int z = level; z <= deepest_level(layer) && std::size_t(z) < all.size(); ++z)
    if (!all[std::size_t(z)].empty()) return z;
  return level;
}

bool any_tile(const proto::LayerJson& layer, int level, const TileRange& within) {
  if (std::size_t(level) >= layer.available.size()) return false;
  return std::ranges::any_of(layer.available[std::size_t(level)], [&](const proto::TileRange& r) {
    return r.start_x <= within.east && within.west <= r.end_x && r.start_y <= within.north &&
           within.south <= r.end_y;
  });
}

/// Is it there, and no tile below it? Not of the roots, which are there also without data.
bool is_last(const proto::LayerJson& layer, int level, std::uint32_t x, std::uint32_t y) {
  return level > 0 && layer.contains(level, x, y) &&
         !any_tile(layer, level + 1, {2 * x, 2 * y, 2 * x + 1, 2 * y + 1});
}

bool is_beside_a_last_one(const proto::LayerJson& layer, int level, std::uint32_t x,
                          std::uint32_t y) {
  const std::uint32_t columns = tiling::columns(level), rows = tiling::rows(level);
  for (const std::uint32_t east : {0u, 1u, columns - 1})
    for (std::uint32_t row = y > 0 ? y - 1 : 0; row <= std::min(y + 1, rows - 1); ++row)
      if (is_last(layer, level, (x + east) % columns, row)) return true;
  return false;
}

/// What of a tile has no tile below it is beyond all data, or a coarse layer's, of which a finer
/// one has the rest: then tiles around it or around one above it are the last there.
bool coarse_data_ends_in(const proto::LayerJson& layer, int level, std::uint32_t x,
                         std::uint32_t y) {
  for (; level > 0; --level, x /= 2, y /= 2)
    if (is_beside_a_last_one(layer, level, x, y)) return true;
  return false;
}

/// Does a part of a tile of this level lie there that has data, but no tile below it?
bool shows_an_end(const proto::LayerJson& layer, const GeoRect& rect, int level) {
  const TileRange parts = tiles_over(rect, level + 1);
  for (std::uint32_t y = parts.south; y <= parts.north; ++y)
    for (std::uint32_t x = parts.west; x <= parts.east; ++x)
      if (!layer.contains(level + 1, x, y) && layer.contains(level, x / 2, y / 2) &&
          coarse_data_ends_in(layer, level, x / 2, y / 2))
        return true;
  return false;
}

}  // namespace

Result<MeshImage> mesh_image(const LevelTiles& tiles, web_mercator::Tile tile, int pixels,
                             const std::stop_token& stop) {
  const auto found = level_heights(tiles, centres(tile, pixels), tile.level, stop);
  if (!found) return std::unexpected(found.error());
  MeshImage image{.pixels = pixels, .heights = {}, .levels = {}};
  image.heights.reserve(found->size());
  std::set<int> levels;
  std::size_t outside = 0;
  for (const auto& here : *found) {
    image.heights.push_back(here ? float(here->height_m) : 0.f);
    if (!here) {
      ++outside;
      continue;
    }
    levels.insert(here->tile.level);
    if (!here->max_error_m) image.max_error_m.reset();
    if (image.max_error_m) image.max_error_m = std::max(*image.max_error_m, *here->max_error_m);
  }
  image.levels.assign(levels.begin(), levels.end());
  image.outside_share = double(outside) / double(found->size());
  return image;
}

bool has_mesh_image(const proto::LayerJson& layer, web_mercator::Tile tile) {
  const GeoRect rect = web_mercator::rect(tile);
  if (tile.level > deepest_level(layer) || !bounds_of(layer).overlaps(rect)) return false;
  const int own = level_with_tiles(layer, tile.level);
  if (any_tile(layer, own, tiles_over(rect, own))) return true;
  for (int level = tile.level - 1; level > 0; --level)
    if (shows_an_end(layer, rect, level)) return true;
  return false;
}

std::optional<double> drawn_error_m(const MeshImage& image, proto::HeightCode code) {
  if (!image.max_error_m) return {};
  return *image.max_error_m + proto::beyond_range_m(image.heights, code);
}

proto::ImagePixels mesh_pixels(const MeshImage& image, proto::HeightCode code,
                               const proto::LayerJson& layer) {
  proto::ImagePixels out{.width = image.pixels,
                         .height = image.pixels,
                         .channels = 3,
                         .samples = proto::height_colours(image.heights, code),
                         .texts = {{"Encoding", std::string(proto::name(code))}},
                         .effort = proto::WebpEffort::thorough};
  if (!layer.datum.empty()) out.texts.emplace_back("Vertical datum", layer.datum);
  out.texts.emplace_back("Step in metres", fmt::format("{}", proto::height_step_m(code)));
  out.texts.emplace_back("Surface", "mesh");
  if (!image.levels.empty())
    out.texts.emplace_back("Levels of the tiles",
                           fmt::format("{}..{}", image.levels.front(), image.levels.back()));
  if (image.max_error_m && !image.levels.empty())
    out.texts.emplace_back("Largest error of the tiles in metres",
                           fmt::format("{}", *drawn_error_m(image, code)));
  out.texts.emplace_back("Share of pixels without tiles",
                         fmt::format("{:.6g}", image.outside_share));
  return out;
}

proto::TileJson mesh_tile_json(const proto::LayerJson& layer, proto::HeightCode code,
                               proto::ImageFormat format, const std::string& name) {
  const GeoRect bounds = bounds_of(layer);
  proto::TileJson json{.name = name,
                       .tiles = {},
                       .maxzoom = deepest_level(layer),
                       .bounds = {bounds.west, bounds.south, bounds.east, bounds.north},
                       .tile_size = kImagePixels,
                       .encoding = std::string(proto::name(code)),
                       .format = name_of(format),
                       .attribution = layer.attribution,
                       .accuracy = layer.accuracy,
                       .words = {{"surface", "mesh"}},
                       .numbers = {{"height_step_m", proto::height_step_m(code)}}};
  if (!layer.datum.empty()) json.words.emplace_back("datum", layer.datum);
  // Across the antimeridian, or around a small fine layer, the middle of the bounds is far from it.
  if (const auto ranges = deepest_ranges(layer); !ranges.empty()) {
    const auto [lon, lat] = place_in(ranges);
    json.center = {lon, std::clamp(lat, bounds.south, bounds.north)};
  }
  return json;
}

}  // namespace tind
