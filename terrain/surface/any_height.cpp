#include "terrain/surface/any_height.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tind {

Result<bool> any_height(const Surface& surface) {
  constexpr std::int64_t kRows = 256, kCols = 4096;  // whole blocks of the source, 4 MB
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    for (std::int64_t row = 0; row < info.rows; row += kRows)
      for (std::int64_t col = 0; col < info.cols; col += kCols) {
        const auto posts = layer.source->read(col, row, int(std::min(kCols, info.cols - col)),
                                              int(std::min(kRows, info.rows - row)));
        if (!posts) return std::unexpected(posts.error());
        if (!std::ranges::all_of(posts->values(), [](float z) { return std::isnan(z); }))
          return true;
      }
  }
  return false;
}

}  // namespace tind
