#include "terrain/pyramid/make/tile_colours.h"

#include <utility>
#include <vector>

#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/tile/level_colours.h"
#include "terrain/tile/tile_model.h"

namespace tind {

std::shared_ptr<const HeldColours> tile_colours(const TileSetOptions& options, TileId id) {
  const auto image = counted_colours(options);
  const GeoRect rect = tiling::rect(id);
  if (!image || !rect.overlaps(image->bounds())) return nullptr;
  constexpr int kCells = 128;  // a side: two to four to a pixel (level_colours.h)
  constexpr double kStep = double(kTileExtent) / kCells;
  std::vector<Geographic> places;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) places.push_back(place_of(rect, {i * kStep, j * kStep, 0}));
  auto nodes = level_colours(places, id.level, *image);
  if (nodes.empty()) return nullptr;
  return std::make_shared<const HeldColours>(kCells, kTileExtent, std::move(nodes));
}

}  // namespace tind
