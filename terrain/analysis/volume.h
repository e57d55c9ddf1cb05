#pragma once
// Cut and fill: the volumes between a DEM and what it is compared with, over an area.

#include <array>
#include <memory>
#include <optional>
#include <variant>

#include "terrain/analysis/area_integral.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// What a DEM is compared with: a height, a plane through three points (x = column, y = row, z in
/// metres) that is flat among the posts, or another DEM.
struct LevelReference {
  double height_m = 0;
};
struct PlaneReference {
  std::array<Vec3, 3> through;
};
struct DemReference {
  std::shared_ptr<const DemSource> dem;
};
using VolumeReference = std::variant<LevelReference, PlaneReference, DemReference>;

/// Heights a + x column + y row.
struct HeightPlane {
  double a = 0, x = 0, y = 0;
  double at(double col, double row) const { return a + x * col + y * row; }
};
/// Fails (invalid_argument) for points on one line.
Result<HeightPlane> plane_through(const std::array<Vec3, 3>&);

/// A number and what it can be.
struct Within {
  double value = 0, low = 0, high = 0;
};

struct Volume {
  double area_m2 = 0;       // compared
  double void_area_m2 = 0;  // of the area, where one of the two has no height
  bool beyond = false;      // some of the area lies beyond the DEM, and is not counted anywhere
  Within cut_m3, fill_m3;   // what lies above the reference, what is missing below it
  Within net_m3;            // cut - fill
};

/// H less the reference at the posts of a row. Another DEM is asked at this one's posts: of one
/// grid that is exact, of two it is the other's surface as these posts see it. The DEM is to
/// outlive it.
Result<PostRow> difference_rows(const DemSource&, const VolumeReference&);

/// The exact integral of the bilinear difference (area_integral.h). `low` and `high` contain the
/// volume of every pair of surfaces whose difference is within `uncertainty_m` of this one at each
/// post: so they contain that of the truth. `area`: in post coordinates. Fails with the sources'
/// errors, (invalid_argument) for a plane whose points lie on one line, DEMs above different datums
/// or without CRS, (cancelled).
Result<Volume> volume(const DemSource&, const VolumeReference&, const PostRings& area,
                      double uncertainty_m = 0, const Progress& = {});

}  // namespace tind
