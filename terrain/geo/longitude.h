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

}  // namespace tind
