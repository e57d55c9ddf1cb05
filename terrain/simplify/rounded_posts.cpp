#include "terrain/simplify/rounded_posts.h"

#include <algorithm>
#include <optional>
#include <variant>

namespace tind {

namespace {

constexpr double kHair = 1 + 1e-6;  // so that what is lifted is still there when it was rounded
constexpr double kLeastShare = 1.0 / 8;  // of a bound: not all methods take 0

Side side_of(const SimplifyOptions& asked) {
  const auto* const bounded = std::get_if<BoundedOptions>(&asked.method);
  return bounded ? bounded->side : Side::both;
}

/// What rounding takes of a bound.
double taken(const SimplifyOptions& asked, double rounding_m) {
  return rounding_m + (side_of(asked) == Side::both ? 0 : rounding_m * kHair);
}

}  // namespace

StopAt within_rounding(const SimplifyOptions& asked, double rounding_m) {
  StopAt stop = asked.stop;
  if (double* const bound = stop.max_error_m ? &*stop.max_error_m : nullptr)
    *bound = std::max(*bound * kLeastShare, *bound - taken(asked, rounding_m));
  return stop;
}

bool has_room_for_rounding(const SimplifyOptions& asked, double rounding_m) {
  const std::optional<double>& bound = asked.stop.max_error_m;
  return !bound || *bound - taken(asked, rounding_m) >= *bound * kLeastShare;
}

void keep_side(const SimplifyOptions& asked, double rounding_m, Tin& tin) {
  const Side side = side_of(asked);
  if (side == Side::both || rounding_m == 0) return;
  const double lift = (side == Side::above ? rounding_m : -rounding_m) * kHair;
  for (Vec3& v : tin.vertices) v.z += lift;
}

}  // namespace tind
