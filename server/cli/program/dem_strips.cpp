#include "server/cli/program/dem_strips.h"

#include <algorithm>
#include <memory>

namespace tind::cli {

ReadStrip strips_of(const DemSource& dem) {
  return [&dem](int row, int rows) { return dem.read(0, row, int(dem.info().cols), rows); };
}

Result<void> for_sample_blocks(const DemSource& dem,
                               const std::function<void(const HeightGrid&)>& look_at) {
  constexpr std::int64_t kBlock = 256, kBlocks = 8;  // posts a side, and blocks
  const DemInfo& info = dem.info();
  const auto first = [&](std::int64_t k, std::int64_t posts) {  // of the k-th block
    return (2 * k + 1) * posts / (2 * kBlocks) / kBlock * kBlock;
  };
  for (std::int64_t j = 0; j < kBlocks; ++j) {
    for (std::int64_t i = 0; i < kBlocks; ++i) {
      const std::int64_t col = first(i, info.cols), row = first(j, info.rows);
      if ((i > 0 && col == first(i - 1, info.cols)) || (j > 0 && row == first(j - 1, info.rows)))
        continue;  // a narrow DEM
      const auto block = dem.read(col, row, int(std::min(kBlock, info.cols - col)),
                                  int(std::min(kBlock, info.rows - row)));
      if (!block) return std::unexpected(block.error());
      look_at(*block);
    }
  }
  return {};
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
