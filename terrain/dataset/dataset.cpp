#include "terrain/dataset/dataset.h"

#include <utility>

#include "terrain/geo/extent_box.h"
#include "terrain/store/layer_place.h"

namespace tind {

GeoRect box_of(const DemInfo& info) {
  if (info.bounds.width() < 360 || info.extents.empty()) return info.bounds;
  return box_around(info.extents);
}

Dataset dataset_of(std::shared_ptr<const TileSet> tiles) {
  const proto::LayerJson& layer = tiles->layer();
  const auto& [west, south, east, north] = layer.bounds;
  DatasetFacts facts{
      {west, south, east, north}, layer_box(layer), layer.datum, layer.attribution, {}};
  return {nullptr, std::move(tiles), [facts = std::move(facts)] { return facts; }};
}

Dataset dataset_of(const Surface& surface) {
  const DemInfo& info = surface.info();
  DatasetFacts facts{info.bounds, box_of(info), name(info.datum), {}, {}};
  return {std::make_shared<const Surface>(surface), nullptr,
          [facts = std::move(facts)] { return facts; }};
}

}  // namespace tind
