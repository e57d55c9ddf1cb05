#pragma once
// Lines and areas in a DEM's CRS, as GeoJSON has them: in longitude and latitude, cut at the
// antimeridian.

#include <memory>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"

class OGRGeometry;
class OGRLinearRing;
class OGRLineString;
class OGRPolygon;
class OGRSimpleCurve;

namespace tind::gdal {

class GeojsonShapes {
 public:
  /// By the way from the DEM's CRS to the globe that DemSource takes, too.
  static Result<GeojsonShapes> make(const DemInfo&);

  /// Corner by corner, so that its sides are as straight on the globe as GDAL's are; near a pole
  /// with so many more that none is farther from the side in the CRS than a hundredth of a post.
  /// Each has its z. What has no place on the globe is left out: there it ends, and begins again.
  /// May be empty.
  Result<std::unique_ptr<OGRGeometry>> line(const OGRLineString&) const;

  /// Within a millimetre at 45 degrees, and a centimetre near a pole. May be empty, and fails, as
  /// cut_area() says, and (bad_data) where a corner has no place on the globe.
  Result<std::unique_ptr<OGRGeometry>> area(const OGRPolygon&) const;

 private:
  struct Place;
  struct Path;
  GeojsonShapes() = default;

  Place place(Vec2 crs, Vec2 globe, double z, const Place* last) const;
  /// More than one, or fewer corners, where some have no longitude and latitude.
  struct Paths {
    std::vector<Path> parts;
    bool whole = true;
  };
  Paths paths(const OGRSimpleCurve&, double most_off_m) const;
  void divide(const Place& from, const Place& to, double most_off_m, int depth, Path&) const;
  double pole_in(const OGRLinearRing&, const Path&) const;

  std::unique_ptr<ToGeographic> way_;  // null: longitude and latitude already
  bool projected_ = false;
  double line_off_m_ = 0;
  double longest_side_ = 0;  // of areas, in units of the CRS
  Vec2 poles_[2] = {};       // in the CRS, the north's first; NaN where it has none
};

}  // namespace tind::gdal
