#include "terrain/pyramid/plan/tile_version.h"

#include <fmt/format.h>

#include "terrain/base/hash.h"
#include "terrain/pyramid/plan/tile_method.h"

namespace tind {

namespace {

std::string grid_digest(const DemInfo& info) {
  const Affine& a = info.post_to_crs;
  return hash128(fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}", info.cols, info.rows, a.x0,
                             a.x_col, a.x_row, a.y0, a.y_col, a.y_row, info.crs_wkt,
                             name(info.datum), info.rounding_m, info.wraps_longitude))
      .text();
}

}  // namespace

int layer_epoch(const Surface& surface) {
  return surface.only() && surface.info().files.size() <= 1 ? 0 : kLayerEpoch;
}

std::string grid_digest(const Surface& surface) {
  if (const DemSource* dem = surface.only()) {
    std::string digest = grid_digest(dem->info());
    if (layer_epoch(surface) == 0) return digest;
    return hash128(fmt::format("files {} {}", kLayerEpoch, digest)).text();
  }
  std::string layers = fmt::format("layers {}\n", kLayerEpoch);
  for (const SurfaceLayer& layer : surface.layers())
    layers += fmt::format("{} {} {}\n", grid_digest(layer.source->info()), layer.blend_m,
                          layer.max_error_m);
  return hash128(layers).text();
}

std::string area_digest(const TilePlan& plan) {
  std::string text;
  bool rectangles = true;
  for (int z = 0; z <= plan.max_level(); ++z) {
    const auto ranges = plan.tiles(z).ranges();
    rectangles = rectangles && ranges.size() == 1;
    for (const TileRange& r : ranges)
      text += fmt::format("{} {} {} {} {}\n", z, r.west, r.south, r.east, r.north);
  }
  return rectangles ? std::string() : hash128(text).text();
}

namespace {

/// How posts come to WGS84 where that is not exact, and may be another way once PROJ has its grids.
std::string ways_of(const Surface& surface) {
  std::string text;
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    if (info.crs_accuracy_m.value_or(1) != 0 && !info.crs_way.empty()) text += " " + info.crs_way;
  }
  return text;
}

}  // namespace

std::string tile_version(const Surface& surface, const TilePlan& plan, const std::string& content) {
  const TileSetOptions& o = plan.options();
  const std::string text =
      fmt::format("{} {} {} {} {} {} {} {}{}{}{}{}{}", grid_digest(surface), content, o.max_error_m,
                  o.error_factor, plan.max_level(), name_of(o.side), name_of(o.effort),
                  o.exact_posts, area_digest(plan), tile_method(o) + drape_fingerprint(o),
                  plan.shapes(), plan.levels_of_shapes(), ways_of(surface));
  constexpr int kBits = 53;  // a number that JavaScript, too, holds whole
  return fmt::format("{}.0.{}", kTileEpoch, hash64(text) >> (64 - kBits));
}

}  // namespace tind
