#include "terrain/mesh/mesh_raster.h"

#include <algorithm>
#include <cmath>

#include "terrain/base/parallel.h"
#include "terrain/mesh/scan_triangle.h"

namespace tind {

namespace {

/// Rows [begin, end) of `posts`, which is row `first` of the mesh's grid and those after it.
void fill_band(const Tin& mesh, const HeightGrid& posts, int first, int begin, int end,
               MeshRaster& out) {
  const auto fill = [&](const PostSpan& span) {
    const int row = span.row - first;
    for (int c = span.first; c <= span.last; ++c) {
      const double h = span.height(c);
      float& height = out.heights.at(c, row);
      if (posts.is_void(c, row)) {
        if (!(h <= double(height))) height = float(h);
        continue;
      }
      const double d = h - double(posts.at(c, row));
      float& error = out.errors.at(c, row);
      if (std::fabs(d) <= std::fabs(double(error))) continue;  // false where there is none yet
      error = float(d);
      height = float(h);
    }
    return true;
  };
  for (const Triangle& t : mesh.triangles) {
    scan_triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], first + begin,
                  first + end, posts.cols(), fill);
  }
}

}  // namespace

MeshRaster mesh_raster(const Tin& mesh, const HeightGrid& posts, int first_row, int threads) {
  MeshRaster out{HeightGrid(posts.cols(), posts.rows()), HeightGrid(posts.cols(), posts.rows())};
  if (threads <= 0) threads = hardware_threads();
  const auto bands = std::size_t(std::clamp(threads, 1, std::max(1, posts.rows())));
  parallel_for(bands, threads, [&](std::size_t i) {
    const auto edge = [&](std::size_t k) {
      return int(std::int64_t(posts.rows()) * std::int64_t(k) / std::int64_t(bands));
    };
    fill_band(mesh, posts, first_row, edge(i), edge(i + 1), out);
  });
  return out;
}

}  // namespace tind
