#pragma once
// Brings a raster's heights from one vertical datum to another.

#include <memory>
#include <span>

#include "terrain/base/result.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/gdal/crs/gdal_frame.h"

namespace tind {

/// Adds what the datum that heights are above lies above the ellipsoid at each post, and takes away
/// what the other one does. Where a post is does not need PROJ for each: in a projected raster with
/// posts up to 100 m apart, positions are bilinear over cells of 8 x 8 posts (off by at most 13 mm
/// on the ground, some 5 um of undulation). The cells are fixed in the raster, so a post's height
/// does not depend on the window it is read with.
class DatumShift {
 public:
  /// Null: the ellipsoid. `unit_m`: metres per unit of the heights. `frame` must outlive this.
  DatumShift(std::shared_ptr<const DatumSurface> from, std::shared_ptr<const DatumSurface> to,
             const gdal::Frame& frame, double unit_m);

  /// heights[r * cols + c] of post (col + c, row + r); voids stay voids. out_of_range where a
  /// height lies outside of a grid: names the place.
  Result<void> add(std::int64_t col, std::int64_t row, int cols, int rows,
                   std::span<double> heights) const;

 private:
  /// One row; `places` of its posts.
  Result<void> add_row(std::span<const Geographic> places, std::span<double> heights) const;
  Result<void> add_each(std::int64_t col, std::int64_t row, int cols, int rows,
                        std::span<double>) const;
  Result<void> add_by_cells(std::int64_t col, std::int64_t row, int cols, int rows,
                            std::span<double>) const;

  std::shared_ptr<const DatumSurface> from_, to_;
  const gdal::Frame& frame_;
  double unit_m_;
  bool by_cells_;
};

}  // namespace tind
