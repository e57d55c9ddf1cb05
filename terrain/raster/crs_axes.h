#pragma once
// Which way the coordinates of a reference system grow: not always to the east and to the north.

#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind {

/// Where a unit of x and one of y lead, as east (x) and north (y) of the grid.
struct CrsAxes {
  Vec2 x{1, 0}, y{0, 1};

  /// Posts to east and north, in units of the crs.
  Affine east_north(const Affine& post_to_crs) const {
    const Affine& a = post_to_crs;
    const auto east = [&](double along_x, double along_y) { return along_x * x.x + along_y * y.x; };
    const auto north = [&](double along_x, double along_y) {
      return along_x * x.y + along_y * y.y;
    };
    return {east(a.x0, a.y0),  east(a.x_col, a.y_col),  east(a.x_row, a.y_row),
            north(a.x0, a.y0), north(a.x_col, a.y_col), north(a.x_row, a.y_row)};
  }
};

/// Of a horizontal system (WKT 2), in the order that coordinates.h has: the system of Lo 29 counts
/// westings and southings, and Krovak's southings before westings. Where both axes lead the same
/// way, as around a pole, y is the grid's north and x its east, as without a system. Errc::io where
/// PROJ's database cannot be read.
Result<CrsAxes> crs_axes(const std::string& wkt);

}  // namespace tind
