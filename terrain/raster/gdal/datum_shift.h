#pragma once
// Converts a raster's orthometric heights (above the geoid) to ellipsoidal ones.

#include <memory>
#include <span>

#include "terrain/geo/geoid.h"
#include "terrain/raster/gdal/gdal_frame.h"

namespace tind {

/// Adds the geoid's undulation at each post. Where a post is does not need PROJ for each: in a
/// projected raster with posts up to 100 m apart, positions are bilinear over cells of 8 x 8 posts
/// (off by at most 13 mm on the ground, some 5 um of undulation). The cells are fixed in the
/// raster, so a post's height does not depend on the window it is read with.
class DatumShift {
 public:
  /// `unit_m`: metres per unit of the heights. `frame` must outlive this.
  DatumShift(std::shared_ptr<const Geoid> geoid, const gdal::Frame& frame, double unit_m);

  /// heights[r * cols + c] of post (col + c, row + r); voids stay voids.
  void add(std::int64_t col, std::int64_t row, int cols, int rows, std::span<double> heights) const;

 private:
  void add_each(std::int64_t col, std::int64_t row, int cols, int rows, std::span<double>) const;
  void add_by_cells(std::int64_t col, std::int64_t row, int cols, int rows,
                    std::span<double>) const;

  std::shared_ptr<const Geoid> geoid_;
  const gdal::Frame& frame_;
  double unit_m_;
  bool by_cells_;
};

}  // namespace tind
