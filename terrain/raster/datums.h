#pragma once
// Vertical datums: by which names people call them, and how far their zero lies from the ellipsoid.
// Grids are looked for where GeographicLib and PROJ keep theirs; PROJ's network stays off.

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/geo/environment.h"
#include "terrain/geo/vertical_datum.h"

namespace tind {

/// What people type: "unknown", "ellipsoid", "egm84", "egm96", "egm2008", the name of one of
/// GeographicLib's grids of these ("egm2008-2_5"), a vertical or compound CRS that PROJ knows
/// ("EPSG:5703", "EPSG:4269+5703"), or a file of a geoid (.pgm as GeographicLib has it; .gtx, .tif
/// as PROJ has it). invalid_argument for anything else, not_found for a file that is not there.
/// Small and capital letters are the same in all but files.
Result<VerticalDatum> datum_named(std::string_view text);

/// By its ending alone: would datum_named() look for a file?
bool names_geoid_file(std::string_view text);

/// The zero of a datum over some area. Thread-safe.
class DatumSurface {
 public:
  virtual ~DatumSurface() = default;
  /// Height above the WGS84 ellipsoid = height above the datum + this, metres; NaN where the grid
  /// does not reach. The spans have the same length.
  virtual void undulations(std::span<const Geographic>, std::span<double> out) const = 0;
  /// What it is taken from, for people: "egm2008-5.pgm, cubic".
  const std::string& way() const { return way_; }
  /// Text that changes when its heights may: part of a source's fingerprint. Empty for the EGM96
  /// that comes along.
  const std::string& identity() const { return identity_; }
  /// As PROJ states it, metres; below 0: it does not.
  double accuracy_m() const { return accuracy_m_; }
  /// What should be known of the choice, one line; empty mostly.
  const std::string& warning() const { return warning_; }

 protected:
  std::string way_, identity_, warning_;
  double accuracy_m_ = -1;
};

/// `area`: where it will be asked; `crs_wkt`: what the DEM is in, whose geographic system may
/// decide between PROJ's ways (empty: WGS84). In whatever units that CRS is, or the datum's where
/// it is a compound one: the surface is asked by longitude and latitude on WGS84. Null for the
/// ellipsoid itself. Errors: not_found names the grid that is missing, where it was looked for and
/// who has it; bad_data for one that is damaged. The first call for a grid reads it (egm2008-1: 0.5
/// GB of memory), later ones share it. REQUIRES: not unknown.
Result<std::shared_ptr<const DatumSurface>> datum_surface(const VerticalDatum&, const GeoRect& area,
                                                          const std::string& crs_wkt,
                                                          const Environment&);

/// Metres per unit of the heights that a CRS names; 1 for all else.
double unit_of(const VerticalDatum&);

}  // namespace tind
