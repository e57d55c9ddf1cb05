#include "terrain/simplify/rounded_posts.h"

#include <algorithm>
#include <variant>

namespace tind {

namespace {

constexpr double kHair = 1 + 1e-6;  // so that what is lifted is still there when it was rounded

Side side_of(const SimplifyOptions& asked) {
  const auto* const bounded = std::get_if<BoundedOptions>(&asked.method);
  return bounded ? bounded->side : Side::both;
}

}  // namespace

StopAt within_rounding(const SimplifyOptions& asked, double rounding_m) {
  StopAt stop = asked.stop;
  const double lift = side_of(asked) == Side::both ? 0 : rounding_m * kHair;
  if (stop.max_error_m) *stop.max_error_m = std::max(0.0, *stop.max_error_m - rounding_m - lift);
  return stop;
}

void keep_side(const SimplifyOptions& asked, double rounding_m, Tin& tin) {
  const Side side = side_of(asked);
  if (side == Side::both || rounding_m == 0) return;
  const double lift = (side == Side::above ? rounding_m : -rounding_m) * kHair;
  for (Vec3& v : tin.vertices) v.z += lift;
}

}  // namespace tind
