#pragma once
// `cluster`: all posts in a cell of a coarse uniform grid become one vertex.
//
// The method of [Rossignac93], with the quadric-optimal representative of [Lindstrom00]. It makes
// one pass over the rows of the source. It needs memory for one row and 100 bytes a cluster,
// whatever the size of the source.
//
// The mesh is valid by construction (without lines). Each vertex stays strictly inside its cell; in
// outer cells, on the rectangle's side or corner. Consider a point where four cells meet. Their
// four vertices lie in its four quadrants, so their quadrilateral is simple and star-shaped around
// the point. One of its diagonals leaves two counter-clockwise triangles. A triangle whose cells
// hold voids stays if it may cover a valid post. So the mesh covers all valid posts and reaches
// into voids by less than a cell.

#include <functional>
#include <span>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// A division of cols x rows posts into clusters: `across` by `down` cells of whole posts.
struct ClusterGrid {
  int cols = 0, rows = 0;
  int across = 2, down = 2;  // 2 <= across <= cols, 2 <= down <= rows
};

/// The division with cells as square (in metres) as can be and at most `triangles` triangles, but
/// no fewer than 2 x 2 clusters. Each post is a cluster where that takes no more than `triangles`.
ClusterGrid cluster_grid(int cols, int rows, double spacing_x_m, double spacing_y_m,
                         std::uint64_t triangles);

/// Fills `heights` with row `row` (NaN: void). Called once for each row, from the first on.
using ReadRow = std::function<Result<void>(int row, std::span<float> heights)>;

/// One streaming pass. With `constraints`, whose grid the rows are, each line keeps a point for
/// each cell that it passes, and a constrained Delaunay triangulation takes the place of the
/// quadrilaterals; it covers voids. Fails with what `read` fails with, (bad_data) when no post is
/// valid, or (cancelled).
Result<Tin> cluster_rows(const ClusterGrid&, double spacing_x_m, double spacing_y_m,
                         const ReadRow& read, const Progress& progress = {},
                         const Constraints* constraints = nullptr);

/// For a source of any size: `read` gives its rows one after the other, from the first row again
/// in each pass. Without voids there is one pass. With voids there are up to three, because only a
/// pass shows how many cells hold a post. Fails (unsupported) for an error bound, which needs the
/// whole grid.
Result<Simplified> cluster_stream(int cols, int rows, double spacing_x_m, double spacing_y_m,
                                  const StopAt&, const ReadRow& read,
                                  const Progress& progress = {});

struct ClusterOptions {
  static constexpr const char* kName = "cluster";

  template <class F>
  static void each_option(F&&) {}
};

/// The method. Clusters come in whole rows and columns, so a triangle count is reached from below,
/// to about one row of cells. For an error bound it tries cell sizes (steps: the number of passes).
Result<Simplified> simplify_cluster(const Terrain& dem, const ClusterOptions&, const RunOptions&,
                                    const Progress&);

}  // namespace tind
