#pragma once
// Coordinate reference systems: describes a raster's CRS, transforms between it and WGS84.

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

class OGRSpatialReference;

namespace tind::gdal {
class Operations;
}

namespace tind::gdal {

struct CrsFacts {
  CrsKind kind = CrsKind::none;
  std::string wkt, name;     // horizontal part (WKT 2), full name
  double unit_m = 1;         // metres per unit (projected)
  double turn = 0;           // 360 degrees in crs units (geographic), else 0
  bool plain_wgs84 = false;  // longitude and latitude, degrees, WGS84, Greenwich
  VerticalDatum datum = VerticalDatum::unknown;
  std::string vertical;        // name of its vertical part; empty where there is none
  double vertical_unit_m = 0;  // 0 where it has no vertical part, nor a third axis but in metres
  bool downwards = false;      // its vertical part, or third axis, counts depths
};

/// Whether this thread can read PROJ's database: without it GDAL describes the CRS of the same file
/// in other words, and knows none by its code. Asked before a file is opened. Errc::io.
Result<void> crs_database();

/// WKT or "EPSG:n", in the order of axes that GIS has. Where PROJ's database fails for a moment,
/// GDAL leaves out what it cannot look up and says nothing: so the text is read twice, and must be
/// the same both times. Errc::io where the database cannot be read, bad_data where the text is no
/// CRS.
Result<OGRSpatialReference> read_crs(const std::string& text);

/// What a layer of a vector file is in: where there is no CRS, lengths without a place. As
/// read_crs().
Result<OGRSpatialReference> crs_of_layer(const std::string& wkt);

/// As WKT 2 of 2019.
std::string wkt2(const OGRSpatialReference&);

/// Reads a file's CRS; nullptr and local (engineering) systems are CrsKind::none. One that names a
/// grid by its path is an error: PROJ would open that file.
Result<CrsFacts> describe(const OGRSpatialReference*);

/// Whether a CRS (WKT 2) names a grid by its path.
bool names_a_file(const std::string& wkt);

/// What a person names: an authority's code, WKT, a PROJ string (which may name grids); never a
/// file or a URL.
Result<CrsFacts> crs_named(const std::string& text);

/// Whether two horizontal systems (CrsFacts::wkt) are the same place for the same numbers.
bool same_crs(const std::string& wkt_a, const std::string& wkt_b);

/// How well PROJ knows where a CRS's places are on WGS84.
struct CrsWay {
  std::string name;                  // of the operation, as PROJ has it
  std::optional<double> accuracy_m;  // as PROJ states it; nothing: it does not
  std::string warning;               // where a grid is missing, or nobody knows how exact it is
};

/// crs <-> geographic. One operation is chosen where the DEM lies and kept for all points, so the
/// result for a point does not depend on which points are asked for with it. Thread-safe.
class ToGeographic {
 public:
  /// `where`: a point of the DEM, in its crs.
  static Result<std::unique_ptr<ToGeographic>> make(const std::string& wkt, Vec2 where);
  ~ToGeographic();

  /// In place, traditional GIS order; NaN where there is no result. to_crs is the inverse of
  /// to_geographic to 1 um on the ground.
  void to_geographic(std::span<Vec2> points) const;
  void to_crs(std::span<Vec2> points) const;
  const CrsWay& way() const { return way_; }

 private:
  ToGeographic(std::unique_ptr<Operations>, CrsWay);
  std::unique_ptr<Operations> operations_;
  /// A datum shift moves heights too, which are dropped: there and back is then a millimetre off.
  bool drifts_ = false;
  CrsWay way_;
};

}  // namespace tind::gdal
