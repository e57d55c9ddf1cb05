#pragma once
// The referee: how far is a mesh from every post of a DEM, or every vertex of a TIN, vertically?
// (The "Delaunay selector" of [Kim], over all samples.)

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/height_grid.h"

namespace tind {

struct VerticalError {
  double max_m = 0, rms_m = 0, mean_m = 0;  // of |mesh - post| over covered valid posts
  double p50_m = 0, p95_m = 0, p99_m = 0;
  double max_above_m = 0, max_below_m = 0;  // mesh above the post / below it, both >= 0
  /// The same, but negative where the mesh keeps that far on the other side of every post; -1 for
  /// any that keeps farther.
  double least_above_m = -1, least_below_m = -1;
  int max_col = -1, max_row = -1;  // where the maximum is, in a DEM
  Vec3 max_at;                     // the point that has it, of points
  std::uint64_t posts = 0;         // valid posts measured
  std::uint64_t uncovered = 0;     // valid posts that no triangle covers
  double bias_m = 0;               // mean of mesh - post
  /// Sums over each row's covered posts of how far the mesh is above them, and below, both >= 0:
  /// times the area of a post, the volume between mesh and DEM.
  std::vector<double> row_above_m, row_below_m;
};

/// Measures `mesh`, whose x, y are POST coordinates with y = -row (so that triangles are
/// counter-clockwise), against all valid posts of `grid`. Each triangle is scan-converted in double
/// precision; a post on a shared edge is measured in both triangles and the larger error counts.
/// Flipped triangles are measured too. O(posts + triangles); 5 bytes per post of memory.
///
/// `slack` (posts) is for meshes from files with 32-bit coordinates: a post that no triangle
/// covers, but that is at most this far outside one in x and in y, is measured against that
/// triangle's rim.
VerticalError vertical_error(const Tin& mesh, const HeightGrid& grid, int threads = 1,
                             double slack = 0);

/// Where each post lies up to `rounding_m` beside the height that it was measured at: the extremes
/// are those of what it may be; means and percentiles stay those that were measured.
VerticalError widened(VerticalError, double rounding_m);

/// Posts [row, row + rows) of a DEM, all of its columns.
using ReadStrip = std::function<Result<HeightGrid>(int row, int rows)>;

/// The same for a DEM that is larger than memory: it is read once, in strips from the north.
/// Percentiles come from a histogram and are up to 0.05 % too large. Memory: a strip and its
/// errors, 4 MB, 8 bytes a triangle. Fails with what `read` fails with.
Result<VerticalError> vertical_error_in_strips(const Tin& mesh, int cols, int rows,
                                               const ReadStrip& read, int threads = 1,
                                               double slack = 0);

/// The same over any points instead of posts, such as a TIN's vertices. `mesh` and `points` are in
/// one frame, whose heights are in units of `z_unit_m` metres. A point on an
/// edge is measured in all triangles that hold it, and the largest error counts. `slack` (units of
/// x and y) as above. There are no rows to sum up. O((points + triangles) log triangles).
VerticalError vertical_error(const Tin& mesh, std::span<const Vec3> points, double z_unit_m,
                             int threads = 1, double slack = 0);

}  // namespace tind
