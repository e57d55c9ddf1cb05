#include "terrain/simplify/common/options.h"

namespace tind {

Result<void> check_stop(const StopAt& stop) {
  if (int(stop.triangles.has_value()) + stop.ratio.has_value() + stop.max_error_m.has_value() !=
      1) {
    return fail(Errc::invalid_argument,
                "give exactly one of a triangle count, a ratio and a maximum error");
  }
  if (stop.triangles && *stop.triangles == 0)
    return fail(Errc::invalid_argument, "the triangle count must be at least 1");
  if (stop.ratio && !(*stop.ratio > 0 && *stop.ratio <= 1))
    return fail(Errc::invalid_argument, "the ratio must be above 0 and at most 1");
  if (stop.max_error_m && !(*stop.max_error_m >= 0 && std::isfinite(*stop.max_error_m)))
    return fail(Errc::invalid_argument, "the maximum error must be a number of metres >= 0");
  return {};
}

}  // namespace tind
