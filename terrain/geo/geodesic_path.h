#pragma once
// A way from place to place along geodesics: the shortest lines on the ellipsoid.

#include <span>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

/// How long a way is, and where on it one is after so many metres [Karney: Algorithms for
/// geodesics, Journal of Geodesy 87, 2013]: WGS84, within nanometres. Making it costs microseconds
/// a place, as does each question; also O(log places).
class GeodesicPath {
 public:
  /// REQUIRES: at least one place.
  explicit GeodesicPath(std::span<const Geographic> places);

  double length_m() const { return reached_m_.back(); }
  /// How far each place is from the first, along the way.
  std::span<const double> reached_m() const { return reached_m_; }
  /// The place after so many metres; the ends where that is beyond them. Longitude from -180 to 180
  /// but for the given places themselves.
  Geographic at(double metres) const;
  /// So far beside it, at a right angle: to the right, looking ahead; negative: to the left.
  /// REQUIRES: two places at least, the first two of them apart.
  Geographic beside(double metres, double right_m) const;
  /// `count` places at equal distances along the way, both ends among them. REQUIRES: 2 at least.
  std::vector<Geographic> evenly(std::size_t count) const;

 private:
  std::vector<Geographic> places_;
  std::vector<double> reached_m_, azimuths_;  // azimuths: from each place but the last
};

}  // namespace tind
