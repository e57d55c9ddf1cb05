#pragma once
// What a stop condition means in triangles, checked.

#include <cmath>
#include <cstdint>
#include <string>

#include "terrain/base/result.h"
#include "terrain/simplify/simplify.h"

namespace tind {

/// The triangle count to come down to; 0 with an error bound, which does its own stopping. Fails
/// (invalid_argument) unless exactly one condition is set and makes sense.
inline Result<std::uint64_t> target_triangles(const StopAt& stop, std::uint64_t input_triangles) {
  const int set =
      int(stop.triangles.has_value()) + stop.ratio.has_value() + stop.max_error_m.has_value();
  if (set != 1) {
    return fail(Errc::invalid_argument,
                "say exactly one of: number of triangles, ratio, maximum error");
  }
  if (stop.triangles) return *stop.triangles;
  if (stop.ratio) {
    if (!(*stop.ratio > 0 && *stop.ratio <= 1))
      return fail(Errc::invalid_argument, "the ratio must lie above 0 and not above 1");
    return std::uint64_t(std::floor(*stop.ratio * double(input_triangles)));
  }
  if (!(*stop.max_error_m >= 0 && std::isfinite(*stop.max_error_m)))
    return fail(Errc::invalid_argument, "the maximum error must be a number of metres, 0 or more");
  return 0;
}

}  // namespace tind
