// How many posts a second the referee measures, on meshes of large, middling and unit triangles,
// percentiles and all.
//
//   vertical_error_bench

#include "terrain/mesh/vertical_error.h"
#include "tests/support/bench.h"

namespace {

using namespace tind;

/// A regular mesh over the grid with cells of `step` posts.
Tin regular_mesh(const HeightGrid& grid, int step) {
  Tin tin;
  const int cols = (grid.cols() - 1) / step + 1, rows = (grid.rows() - 1) / step + 1;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c)
      tin.vertices.push_back({double(c * step), -double(r * step), grid.at(c * step, r * step)});
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const auto nw = std::uint32_t(r * cols + c), sw = nw + std::uint32_t(cols);
      tin.triangles.push_back({nw, sw, nw + 1});
      tin.triangles.push_back({sw + 1, nw + 1, sw});
    }
  }
  return tin;
}

}  // namespace

int main() {
  const HeightGrid grid = test::rough_terrain(2049, 2049, 1);
  fmt::print("{:>6} {:>10} {:>10} {:>10}\n", "step", "triangles", "ms", "M posts/s");
  for (const int step : {1024, 128, 16, 4, 1}) {
    const Tin mesh = regular_mesh(grid, step);
    std::vector<double> seconds;
    for (int run = 0; run < 5; ++run)
      seconds.push_back(test::seconds_of([&] { vertical_error(mesh, grid); }));
    const double s = test::median(seconds);
    fmt::print("{:6} {:10} {:10.2f} {:10.1f}\n", step, mesh.triangles.size(), 1e3 * s,
               double(grid.size()) / s / 1e6);
  }
}
