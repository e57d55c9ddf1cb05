// Coarse tiles reach far beyond the data: what counts are columns of tiles without a tile below.

#include "terrain/store/layer_place.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "terrain/geo/extent_box.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind {

Result<proto::LayerJson> layer_of(const TileStore& store) {
  const auto text = store.layer_json();
  if (!text) return std::unexpected(text.error());
  return proto::decode_layer_json({reinterpret_cast<const char*>(text->data()), text->size()});
}

TileArea area_of(const std::vector<proto::TileRange>& level) {
  std::vector<TileRange> ranges;
  ranges.reserve(level.size());
  for (const proto::TileRange& r : level)
    ranges.push_back({r.start_x, r.start_y, r.end_x, r.end_y});
  return TileArea(std::move(ranges));
}
namespace {

using Level = std::vector<proto::TileRange>;

GeoRect bounds_of(const proto::LayerJson& layer) {
  const auto& [west, south, east, north] = layer.bounds;
  return {west, south, east, north};
}

bool says_places(const proto::LayerJson& layer) {
  return layer.projection == "EPSG:4326" && !layer.available.empty() &&
         layer.available.size() <= std::size_t(tiling::kMaxLevel) + 1;
}

/// Columns [first, second) of tiles.
using Columns = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

/// From the west, those that touch as one. `halved`: the columns of the level above.
Columns columns_of(const Level& ranges, bool halved) {
  Columns all;
  for (const proto::TileRange& r : ranges)
    all.emplace_back(halved ? r.start_x / 2 : r.start_x,
                     std::uint64_t(halved ? r.end_x / 2 : r.end_x) + 1);
  std::ranges::sort(all);
  Columns merged;
  for (const auto& one : all)
    if (!merged.empty() && one.first <= merged.back().second)
      merged.back().second = std::max(merged.back().second, one.second);
    else
      merged.push_back(one);
  return merged;
}

/// f(first, end) of what of `columns` is not in `others`. Both as columns_of() has them.
template <class F>
void each_without(const Columns& columns, const Columns& others, F&& f) {
  auto other = others.begin();
  for (auto [first, end] : columns) {
    while (other != others.end() && other->second <= first) ++other;
    for (auto next = other; next != others.end() && next->first < end; ++next) {
      if (next->first > first) f(first, next->first);
      first = std::max(first, next->second);
    }
    if (first < end) f(first, end);
  }
}

std::optional<GeoRect> box_of_tiles(const proto::LayerJson& layer) {
  const GeoRect bounds = bounds_of(layer);
  std::vector<GeoRect> last;  // columns without a tile below
  for (std::size_t z = 0; z < layer.available.size(); ++z) {
    const double side = tiling::tile_degrees(int(z));
    const Columns below =
        z + 1 < layer.available.size() ? columns_of(layer.available[z + 1], true) : Columns();
    each_without(columns_of(layer.available[z], false), below,
                 [&](std::uint64_t first, std::uint64_t end) {
                   last.push_back({std::min(-180 + double(first) * side, 180.), bounds.south,
                                   std::min(-180 + double(end) * side, 180.), bounds.north});
                 });
  }
  if (last.empty()) return {};
  return box_around(last);
}

}  // namespace

GeoRect layer_box(const proto::LayerJson& layer) {
  const GeoRect bounds = bounds_of(layer);
  if (bounds.width() < 360 || !says_places(layer)) return bounds;
  const auto box = box_of_tiles(layer);
  return box && box->width() <= 270 ? *box : bounds;
}

std::vector<GeoRect> deepest_ranges(const proto::LayerJson& layer) {
  std::vector<GeoRect> rects;
  if (!says_places(layer)) return rects;
  const GeoRect bounds = bounds_of(layer);
  const double side = tiling::tile_degrees(int(layer.available.size()) - 1);
  for (const proto::TileRange& r : layer.available.back()) {
    const GeoRect rect{std::max(bounds.west, -180 + r.start_x * side),
                       std::max(bounds.south, -90 + r.start_y * side),
                       std::min(bounds.east, -180 + (r.end_x + 1.) * side),
                       std::min(bounds.north, -90 + (r.end_y + 1.) * side)};
    if (rect.west < rect.east && rect.south < rect.north) rects.push_back(rect);
  }
  return rects;
}

}  // namespace tind
