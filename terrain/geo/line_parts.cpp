#include "terrain/geo/line_parts.h"

#include <algorithm>
#include <cmath>

namespace tind {

std::vector<HeightLine> line_parts(std::span<const LinePoint> line) {
  std::vector<HeightLine> parts(1);
  for (const LinePoint& p : line) {
    const LinePoint last = parts.back().empty() ? p : parts.back().back();
    if (std::abs(p.place.lon - last.place.lon) > 180) {
      const double side = last.place.lon > 0 ? 180 : -180, to = p.place.lon + 2 * side;
      const double t = to == last.place.lon ? 0 : (side - last.place.lon) / (to - last.place.lon);
      const auto between = [t](double a, double b) { return a + t * (b - a); };  // NaN of NaN
      const double lat = between(last.place.lat, p.place.lat);
      const double height = between(last.height_m, p.height_m);
      parts.back().push_back({{side, lat}, height});
      parts.push_back({{{-side, lat}, height}});
    }
    parts.back().push_back(p);
  }
  return parts;
}

bool has_all_heights(std::span<const LinePoint> line) {
  return std::ranges::none_of(line, [](const LinePoint& p) { return std::isnan(p.height_m); });
}

}  // namespace tind
