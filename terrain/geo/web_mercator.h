#pragma once
// WebMercatorQuad, the pyramid of web maps (OGC 17-083r4, annex D.1): one root tile, rows counted
// from the north, each level halves a tile's side.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "terrain/geo/coordinates.h"

namespace tind::web_mercator {

/// Deepest level offered: a pixel of 512 a tile is 2 cm on the equator.
inline constexpr int kMaxLevel = 22;
inline constexpr double kEarthM = 2 * std::numbers::pi * 6378137;  // around the equator

/// A checked address; made only by tile().
struct Tile {
  int level = 0;
  std::uint32_t x = 0, y = 0;  // y from the north
  friend auto operator<=>(const Tile&, const Tile&) = default;
};

/// Nothing when outside the pyramid.
inline std::optional<Tile> tile(std::int64_t level, std::int64_t x, std::int64_t y) {
  if (level < 0 || level > kMaxLevel) return std::nullopt;
  const std::int64_t side = std::int64_t(1) << level;
  if (x < 0 || y < 0 || x >= side || y >= side) return std::nullopt;
  return Tile{int(level), std::uint32_t(x), std::uint32_t(y)};
}

/// Shares of the square map, 0..1: u eastward, v southward. Exact at tile edges.
inline double u_of(double lon) { return (lon + 180) / 360; }
inline double v_of(double lat) {
  const double s = std::sin(lat * (std::numbers::pi / 180));
  return 0.5 - std::log((1 + s) / (1 - s)) / (4 * std::numbers::pi);
}
inline double lon_of(double u) { return u * 360 - 180; }
inline double lat_of(double v) {
  return std::atan(std::sinh(std::numbers::pi * (1 - 2 * v))) * (180 / std::numbers::pi);
}

inline GeoRect rect(Tile t) {
  const double side = 1.0 / double(std::uint64_t(1) << t.level);
  return {lon_of(t.x * side), lat_of((t.y + 1) * side), lon_of((t.x + 1) * side),
          lat_of(t.y * side)};
}

}  // namespace tind::web_mercator
