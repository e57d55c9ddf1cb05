#pragma once
// Places as somebody writes them down in a reference system of EPSG's list: in the order of its
// axes, which is often north first, and in its units.

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind {

/// "EPSG:2056": nothing that could name a file.
bool is_epsg_code(std::string_view);

/// Whether places in it are longitudes and latitudes: CRS84 (also as nothing), or one of EPSG's.
bool is_geographic(const std::string& crs);

/// Thread-safe.
class CrsPoints {
 public:
  /// `code`: as is_epsg_code(); `near`: where the places are, which decides between PROJ's ways to
  /// WGS84, so that a place does not depend on which others it is asked with. invalid_argument,
  /// saying why: no such system, one without places on the globe (vertical, geocentric), or one
  /// that has no way there. Tens of milliseconds.
  static Result<std::unique_ptr<CrsPoints>> make(const std::string& code, Geographic near);
  /// A plane of metres around a place, x east and y north from there: the transverse Mercator
  /// projection of WGS84 with the scale 1 on the place's meridian. Conformal: d metres east or west
  /// of it lengths are d^2 / (2 R^2) too long, 12 mm a kilometre at 31 km.
  static Result<std::unique_ptr<CrsPoints>> local(Geographic middle);
  virtual ~CrsPoints() = default;

  /// First axis in x, second in y; NaN where there is no such place.
  virtual void to_geographic(std::span<const Vec2> points, std::span<Geographic> out) const = 0;
  virtual void from_geographic(std::span<const Geographic> places, std::span<Vec2> out) const = 0;

  /// "Easting (east)", "Geodetic latitude (north)": what x and y are.
  const std::array<std::string, 2>& axes() const { return axes_; }
  bool east_first() const { return east_first_; }
  /// What a program that knows PROJ takes for it: the code, or a PROJ string.
  const std::string& text() const { return text_; }
  /// WKT 2 of its horizontal part.
  const std::string& wkt() const { return wkt_; }
  /// Degrees (or grads), not lengths.
  bool geographic() const { return geographic_; }

 protected:
  std::array<std::string, 2> axes_;
  bool east_first_ = true;
  bool geographic_ = false;
  std::string text_, wkt_;
};

}  // namespace tind
