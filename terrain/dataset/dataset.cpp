#include "terrain/dataset/dataset.h"

#include <utility>

namespace tind {

Dataset dataset_of(std::shared_ptr<const TileSet> tiles) {
  const proto::LayerJson& layer = tiles->layer();
  const auto& [west, south, east, north] = layer.bounds;
  DatasetFacts facts{{west, south, east, north}, layer.datum, layer.attribution, {}};
  return {nullptr, std::move(tiles), [facts = std::move(facts)] { return facts; }};
}

Dataset dataset_of(const Surface& surface) {
  const DemInfo& info = surface.info();
  DatasetFacts facts{info.bounds, name(info.datum), {}, {}};
  return {std::make_shared<const Surface>(surface), nullptr,
          [facts = std::move(facts)] { return facts; }};
}

}  // namespace tind
