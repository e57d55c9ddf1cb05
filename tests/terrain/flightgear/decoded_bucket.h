#pragma once
// A bucket as FlightGear has it in memory, and rays through it: none of this is shared with what
// makes buckets.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/tile/btg.h"
#include "terrain/base/deflate.h"
#include "terrain/geo/coordinates.h"
#include "terrain/geo/ellipsoid.h"

namespace tind::test {

struct DecodedBucket {
  std::vector<Vec3> vertices;  // ECEF: the centre and a float, added as doubles
  std::vector<std::array<std::uint32_t, 3>> triangles;
  proto::Btg btg;

  explicit DecodedBucket(const std::vector<std::uint8_t>& btg_gz) {
    const auto bytes = gunzip(btg_gz, 1u << 28);
    btg = proto::decode_btg(bytes.value()).value();
    for (const auto& v : btg.vertices)
      vertices.push_back({btg.center[0] + v[0], btg.center[1] + v[1], btg.center[2] + v[2]});
    for (const auto& part : btg.parts)
      for (const auto& t : part.triangles)
        triangles.push_back({t[0].vertex, t[1].vertex, t[2].vertex});
    sort_into_cells();
  }

  /// Of the place above the ellipsoid, where a ray straight down meets the ground; nothing where it
  /// meets none. ([Moeller97], in ECEF.)
  std::optional<double> height_at(Geographic p) const {
    const double lon = p.lon * M_PI / 180, lat = p.lat * M_PI / 180;
    const Vec3 up{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
    constexpr double kA = 6378137, kE2 = 6.69437999014e-3;
    const double n = kA / std::sqrt(1 - kE2 * up.z * up.z);
    const Vec3 foot{n * up.x, n * up.y, n * (1 - kE2) * up.z};
    std::optional<double> highest;
    const auto cell = std::size_t(row(p.lat)) * std::size_t(side_) + std::size_t(column(p.lon));
    for (const std::uint32_t i : cells_[cell]) {
      const Vec3 &a = vertices[triangles[i][0]], &b = vertices[triangles[i][1]],
                 &c = vertices[triangles[i][2]];
      const Vec3 ab = b - a, ac = c - a, h = cross(up, ac), s = foot - a;
      const double det = dot(ab, h);
      if (std::abs(det) < 1e-9) continue;
      const double u = dot(s, h) / det, v = dot(up, cross(s, ab)) / det;
      constexpr double kHair = 1e-7;
      if (u < -kHair || v < -kHair || u + v > 1 + kHair) continue;
      const double t = dot(ac, cross(s, ab)) / det;
      highest = std::max(highest.value_or(t), t);
    }
    return highest;
  }

 private:
  // Triangles by cells of longitude and latitude, with room for how their sides bow.
  int side_ = 1;
  GeoRect rect_{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  std::vector<std::vector<std::uint32_t>> cells_;

  static int index(double x, double from, double to, int count) {
    return std::clamp(int((x - from) / (to - from) * count), 0, count - 1);
  }
  int column(double lon) const { return index(lon, rect_.west, rect_.east, side_); }
  int row(double lat) const { return index(lat, rect_.south, rect_.north, side_); }

  void sort_into_cells() {
    std::vector<Geographic> places;
    for (const Vec3& v : vertices) {
      places.push_back(wgs84::from_ecef(v).p);
      const Geographic p = places.back();
      rect_ = {std::min(rect_.west, p.lon), std::min(rect_.south, p.lat),
               std::max(rect_.east, p.lon), std::max(rect_.north, p.lat)};
    }
    side_ = std::clamp(int(4 * std::sqrt(double(triangles.size()))), 1, 1500);
    cells_.resize(std::size_t(side_) * std::size_t(side_));
    const double narrow = std::max(0.002, std::cos(rect_.north * M_PI / 180));
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const auto& [a, b, c] = triangles[i];
      const auto [lon_low, lon_high] = std::minmax({places[a].lon, places[b].lon, places[c].lon});
      const auto [lat_low, lat_high] = std::minmax({places[a].lat, places[b].lat, places[c].lat});
      // More than a side of that length bows at 89 degrees.
      const double size = std::hypot((lon_high - lon_low) * narrow, lat_high - lat_low);
      const double down = 1e-6 + size * size, across = down / narrow;
      const int west = column(lon_low - across), east = column(lon_high + across),
                south = row(lat_low - down), north = row(lat_high + down);
      for (int y = south; y <= north; ++y)
        for (int x = west; x <= east; ++x)
          cells_[std::size_t(y) * std::size_t(side_) + std::size_t(x)].push_back(i);
    }
  }
};

/// Sides of triangles of several buckets together, by the exact places of their ends, each in the
/// direction in which it runs: how many there are of each without one that runs the other way.
inline std::map<std::pair<std::array<double, 3>, std::array<double, 3>>, int> open_sides(
    const std::vector<const DecodedBucket*>& buckets) {
  std::map<std::pair<std::array<double, 3>, std::array<double, 3>>, int> sides;
  for (const DecodedBucket* bucket : buckets)
    for (const auto& t : bucket->triangles)
      for (int k = 0; k < 3; ++k) {
        // (Plus zero: -0 is 0.)
        const Vec3 &p = bucket->vertices[t[k]], &q = bucket->vertices[t[(k + 1) % 3]];
        const std::array<double, 3> a{p.x + 0.0, p.y + 0.0, p.z + 0.0},
            b{q.x + 0.0, q.y + 0.0, q.z + 0.0};
        if (const auto twin = sides.find({b, a}); twin != sides.end() && twin->second > 0) {
          if (--twin->second == 0) sides.erase(twin);
        } else {
          ++sides[{a, b}];
        }
      }
  return sides;
}

}  // namespace tind::test
