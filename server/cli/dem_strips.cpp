#include "server/cli/dem_strips.h"

#include <algorithm>
#include <memory>

namespace tind::cli {

ReadStrip strips_of(const DemSource& dem) {
  return [&dem](int row, int rows) { return dem.read(0, row, int(dem.info().cols), rows); };
}

ReadRow rows_of(const DemSource& dem) {
  constexpr int kStrip = 256;  // as high as the blocks that a source is read in
  struct Held {
    int first = -1;
    HeightGrid posts;
  };
  return [&dem, held = std::make_shared<Held>()](int row, std::span<float> out) -> Result<void> {
    if (const int first = row / kStrip * kStrip; first != held->first) {
      held->posts = {};
      auto strip =
          strips_of(dem)(first, int(std::min<std::int64_t>(kStrip, dem.info().rows - first)));
      if (!strip) return std::unexpected(strip.error());
      held->posts = std::move(*strip);
      held->first = first;
    }
    std::ranges::copy(held->posts.row(row - held->first), out.begin());
    return {};
  };
}

}  // namespace tind::cli
