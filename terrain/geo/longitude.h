#pragma once
// Longitudes that people give in any turn.

#include <cmath>

#include "terrain/geo/coordinates.h"

namespace tind {

/// The same place with its longitude in [-180, 180).
inline Geographic within_first_turn(Geographic p) {
  p.lon -= 360 * std::floor((p.lon + 180) / 360);
  return p;
}

/// The same place of a circle that is once around after `turn`: that nearest to another.
inline double nearest_turn(double x, double other, double turn) {
  return x + turn * std::round((other - x) / turn);
}

}  // namespace tind
