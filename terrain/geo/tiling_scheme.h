#pragma once
// The EPSG:4326 TMS pyramid of globe clients: two root tiles, each level halves a tile's side.

#include <cstdint>
#include <optional>
#include <string>

#include "terrain/geo/coordinates.h"

namespace tind {

/// A checked tile address; TMS (row 0 in the south). Made only by `tile()`, `parent()`, `child()`.
struct TileId {
  int level = 0;
  std::uint32_t x = 0, y = 0;
  friend auto operator<=>(const TileId&, const TileId&) = default;

  TileId parent() const { return {level - 1, x / 2, y / 2}; }
  TileId child(int east, int north) const { return {level + 1, 2 * x + east, 2 * y + north}; }
  std::string text() const {
    return std::to_string(level) + "/" + std::to_string(x) + "/" + std::to_string(y);
  }
};

namespace tiling {

/// Deepest level offered: 180 / 2^24 degrees is 1.2 m, and 2^25 columns fit a 32-bit index.
inline constexpr int kMaxLevel = 24;

/// The error in metres that globe clients assume of level 0; halved by each level
/// (6378137 * 2 pi * 0.25 / (65 * 2)).
inline constexpr double kLevelZeroError = 77067.33965563798;

inline std::uint32_t columns(int level) { return 2u << level; }
inline std::uint32_t rows(int level) { return 1u << level; }
inline double tile_degrees(int level) { return 180.0 / double(1u << level); }

/// What a client takes the error of a level to be, in metres.
inline double level_error(int level) { return kLevelZeroError / double(1u << level); }

/// The only way from untrusted numbers to a TileId; nothing when outside the pyramid.
inline std::optional<TileId> tile(std::int64_t level, std::int64_t x, std::int64_t y) {
  if (level < 0 || level > kMaxLevel || x < 0 || y < 0) return std::nullopt;
  if (x >= columns(int(level)) || y >= rows(int(level))) return std::nullopt;
  return TileId{int(level), std::uint32_t(x), std::uint32_t(y)};
}

/// Exact: tile edges are dyadic fractions of 180 degrees, so neighbours agree to the last bit.
inline GeoRect rect(TileId t) {
  const double side = tile_degrees(t.level);
  return {-180 + t.x * side, -90 + t.y * side, -180 + (t.x + 1) * side, -90 + (t.y + 1) * side};
}

}  // namespace tiling
}  // namespace tind
