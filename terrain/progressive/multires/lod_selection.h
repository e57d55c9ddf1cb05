#pragma once
// From which distance on a level of detail is good enough: where its error projects to at most the
// tolerance. Of several levels the coarsest that is good enough is the one to show.

#include <cmath>

namespace tind {

/// A level whose error is e metres is good enough from e times this many metres on, for a camera
/// with `size_px` pixels across `fov_rad`. REQUIRES: all three positive, fov_rad < pi.
inline double distance_per_error(double size_px, double fov_rad, double tolerance_px) {
  return size_px / (2 * std::tan(fov_rad / 2) * tolerance_px);
}

}  // namespace tind
