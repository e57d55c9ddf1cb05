#include "server/cli/pictures/colours.h"

#include <algorithm>
#include <cmath>

namespace tind::cli {

Pixel mix(const Pixel& a, const Pixel& b, double t) {
  Pixel out;
  for (int k = 0; k < 3; ++k) out[k] = std::uint8_t(std::lround(a[k] + t * (b[k] - a[k])));
  return out;
}

Pixel land(double t) {
  constexpr Pixel kStops[] = {
      {176, 205, 166}, {222, 220, 174}, {224, 190, 146}, {198, 166, 146}, {246, 244, 242}};
  const double x = std::clamp(t, 0.0, 1.0) * 4;
  const int i = std::min(3, int(x));
  return mix(kStops[i], kStops[i + 1], x - i);
}

Pixel difference(double t) {
  constexpr Pixel kLow = {33, 102, 172}, kNone = {247, 247, 247}, kHigh = {178, 24, 43};
  const double s = std::min(1.0, std::max(0.0, std::abs(t) - 0.05) / 0.95);
  return mix(kNone, t < 0 ? kLow : kHigh, std::sqrt(s));
}

double light_on(const Vec3& n) {
  return std::max(0.0, (-n.x + n.y + std::sqrt(2.0) * n.z) / (2 * std::max(1e-300, length(n))));
}

Pixel lit(const Pixel& colour, double light) {
  return mix({38, 44, 58}, colour, std::min(1.0, 0.12 + 1.2 * light));
}

}  // namespace tind::cli
