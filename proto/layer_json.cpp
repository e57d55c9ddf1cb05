#include "proto/layer_json.h"

#include <algorithm>

namespace tind::proto {

bool LayerJson::contains(int z, std::uint32_t x, std::uint32_t y) const {
  if (z < 0 || std::size_t(z) >= available.size()) return false;
  return std::ranges::any_of(available[std::size_t(z)], [&](const TileRange& r) {
    return x >= r.start_x && x <= r.end_x && y >= r.start_y && y <= r.end_y;
  });
}

}  // namespace tind::proto
