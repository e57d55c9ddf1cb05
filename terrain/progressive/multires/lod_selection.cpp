// Two looks at one table: with the distance as it is for what is needed, with the distance less the
// hysteresis for what is allowed.

#include "terrain/progressive/multires/lod_selection.h"

#include <algorithm>

namespace tind {

namespace {

int coarsest_at(std::span<const double> from_m, double distance_m) {
  const auto beyond = std::upper_bound(from_m.begin(), from_m.end(), distance_m);
  return std::max(0, int(beyond - from_m.begin()) - 1);
}

}  // namespace

std::vector<double> distances_of_errors(std::span<const double> errors_m, double pixels_per_radian,
                                        double tolerance_px) {
  std::vector<double> from_m;
  for (const double error : errors_m) from_m.push_back(error * pixels_per_radian / tolerance_px);
  if (!from_m.empty()) from_m[0] = 0;
  return from_m;
}

int select_level(std::span<const double> from_m, double distance_m, int shown, double hysteresis) {
  const int needed = coarsest_at(from_m, distance_m);
  if (shown < 0 || needed < shown) return needed;
  return std::max(shown, coarsest_at(from_m, distance_m / (1 + hysteresis)));
}

}  // namespace tind
