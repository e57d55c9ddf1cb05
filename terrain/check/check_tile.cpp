// Culling is checked by angles seen from the earth's centre: from a camera c outside the unit
// sphere a point p is hidden when angle(c, p) > acos(1/|c|) + acos(1/|p|), so an occlusion point P
// stands for vertex p when  angle(P, p) + acos(1/|p|) <= acos(1/|P|).  That holds for any direction
// of P.

#include "terrain/check/check_tile.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "proto/json_member.h"
#include "proto/json_text.h"

namespace tind {
namespace {

constexpr double kA = 6378137.0;          // metres
constexpr double kB = 6356752.314245179;  // metres
constexpr double kDegree = std::numbers::pi / 180;
constexpr std::int32_t kEnd = 32767;
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr const char* kSides[] = {"west", "south", "east", "north"};

std::string number(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

/// Geocentric coordinates by the reduced latitude.
Vec3 geocentric(double lon, double lat, double height) {
  const double reduced = std::atan2(kB * std::sin(lat * kDegree), kA * std::cos(lat * kDegree));
  const double across = kA * std::cos(reduced) + height * std::cos(lat * kDegree);
  return {across * std::cos(lon * kDegree), across * std::sin(lon * kDegree),
          kB * std::sin(reduced) + height * std::sin(lat * kDegree)};
}

Vec3 scaled(const Vec3& p) { return {p.x / kA, p.y / kA, p.z / kB}; }

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

/// acos(r / size), exact for size near r; 0 inside.
double horizon_angle(double size, double r) {
  if (size <= r) return 0;
  return std::atan2(std::sqrt((size - r) * (size + r)), r);
}

class TileCheck {
 public:
  TileCheck(const CheckedTile& tile, TileId id, Findings& findings)
      : t_(tile), rect_(tiling::rect(id)), where_(id.text()), findings_(findings) {}

  void run() {
    if (t_.u.size() < 4 || t_.triangles.size() < 2)
      report(rule("tile.empty"), std::to_string(t_.u.size()) + " vertices, " +
                                     std::to_string(t_.triangles.size()) + " triangles");
    heights();
    for (int side = 0; side < 4; ++side) edge(side);
    mesh();
    if (!t_.u.empty()) culling();
  }

 private:
  void report(std::size_t r, const std::string& detail) { findings_.add(r, where_, detail); }

  void heights() {
    if (t_.min_height > t_.max_height)
      report(rule("height.range"), number(t_.min_height) + " > " + number(t_.max_height));
    // Of what is drawn: the range of a header may reach farther, so that its steps are round.
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = 0; i < t_.h.size(); ++i)
      low = std::min(low, t_.height(i)), high = std::max(high, t_.height(i));
    if (low < -12000 || high > 10000)
      report(rule("height.plausible"), number(low) + ".." + number(high) + " m");
  }

  // ---- edges ----

  /// Across is the coordinate that is constant on a side, along the other one.
  std::int32_t across(int side, std::uint32_t i) const { return side % 2 == 0 ? t_.u[i] : t_.v[i]; }
  std::int32_t along(int side, std::uint32_t i) const { return side % 2 == 0 ? t_.v[i] : t_.u[i]; }

  void edge(int side) {
    std::vector<std::uint32_t> list = t_.edges[std::size_t(side)];
    const std::string name = kSides[side];
    if (list.size() < 2) report(rule("edge.short"), name + " lists " + std::to_string(list.size()));
    if (std::ranges::any_of(list, [&](auto i) { return i >= t_.u.size(); }))
      return report(rule("edge.index"), name);
    const std::int32_t place = side < 2 ? 0 : kEnd;
    const auto on_side = [&](std::uint32_t i) { return across(side, i) == place; };
    const auto off = std::ranges::count_if(list, [&](auto i) { return !on_side(i); });
    if (off) report(rule("edge.off"), name + ": " + std::to_string(off) + " vertices");
    edge_order(side, list);
    std::ranges::sort(list);
    const auto twice = std::ranges::unique(list);
    if (!twice.empty()) report(rule("edge.duplicate"), name);
    list.erase(twice.begin(), twice.end());
    std::size_t missing = 0;
    for (std::uint32_t i = 0; i < t_.u.size(); ++i)
      missing += on_side(i) && !std::ranges::binary_search(list, i);
    if (missing) report(rule("edge.missing"), name + ": " + std::to_string(missing) + " vertices");
    for (const std::int32_t corner : {0, kEnd})
      if (std::ranges::none_of(list,
                               [&](auto i) { return on_side(i) && along(side, i) == corner; }))
        report(rule("edge.corner"), name + " at " + std::to_string(corner));
  }

  void edge_order(int side, const std::vector<std::uint32_t>& list) {
    const int sign = side == 0 || side == 3 ? 1 : -1;  // W and N ascend, S and E descend
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
      return sign * along(side, a) < sign * along(side, b);
    };
    if (!std::ranges::is_sorted(list, before)) report(rule("edge.order"), kSides[side]);
  }

  // ---- mesh ----

  std::int64_t double_area(const std::array<std::uint32_t, 3>& t) const {
    const auto [a, b, c] = t;
    return std::int64_t(t_.u[b] - t_.u[a]) * (t_.v[c] - t_.v[a]) -
           std::int64_t(t_.v[b] - t_.v[a]) * (t_.u[c] - t_.u[a]);
  }

  void mesh() {
    std::size_t clockwise = 0, flat = 0;
    std::int64_t covered = 0;
    std::vector<bool> used(t_.u.size());
    for (const auto& triangle : t_.triangles) {
      const std::int64_t area = double_area(triangle);
      clockwise += area < 0;
      flat += area == 0;
      covered += area;
      for (const std::uint32_t i : triangle) used[i] = true;
    }
    if (clockwise) report(rule("mesh.orientation"), std::to_string(clockwise) + " triangles");
    if (flat) report(rule("mesh.degenerate"), std::to_string(flat) + " triangles");
    const auto unused = std::ranges::count(used, false);
    if (unused) report(rule("tile.unused"), std::to_string(unused) + " vertices");
    for (const std::int32_t u : {0, kEnd})
      for (const std::int32_t v : {0, kEnd}) corner(u, v);
    const std::size_t loose = loose_edges();
    const std::int64_t whole = 2 * std::int64_t(kEnd) * kEnd;
    if (covered != whole || loose)
      report(rule("mesh.cover"), number(100 * double(covered) / double(whole)) +
                                     " % of the area, " + std::to_string(loose) +
                                     " open edges inside");
  }

  void corner(std::int32_t u, std::int32_t v) {
    for (std::size_t i = 0; i < t_.u.size(); ++i)
      if (t_.u[i] == u && t_.v[i] == v) return;
    report(rule("mesh.corners"), "none at " + std::to_string(u) + ", " + std::to_string(v));
  }

  /// Edges of one triangle only that do not lie on the border. With all triangles
  /// counter-clockwise, every inner edge matched and the right sum of areas, the cover is exact.
  std::size_t loose_edges() {
    std::vector<std::uint64_t> edges;
    edges.reserve(3 * t_.triangles.size());
    for (const auto& [a, b, c] : t_.triangles)
      for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}})
        edges.push_back(std::uint64_t(from) << 32 | to);
    std::ranges::sort(edges);
    if (std::ranges::adjacent_find(edges) != edges.end())
      report(rule("mesh.manifold"), "an edge is used twice in one direction");
    return std::size_t(std::ranges::count_if(edges, [&](std::uint64_t e) {
      const std::uint64_t reverse = e << 32 | e >> 32;
      return !std::ranges::binary_search(edges, reverse) &&
             !on_border(std::uint32_t(e >> 32), std::uint32_t(e));
    }));
  }

  bool on_border(std::uint32_t a, std::uint32_t b) const {
    const auto both = [](std::int32_t x, std::int32_t y) {
      return x == y && (x == 0 || x == kEnd);
    };
    return both(t_.u[a], t_.u[b]) || both(t_.v[a], t_.v[b]);
  }

  // ---- culling and normals ----

  void culling() {
    std::vector<Vec3> places(t_.u.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double lon = rect_.west + rect_.width() * t_.u[i] / kEnd;
      const double lat = rect_.south + rect_.height() * t_.v[i] / kEnd;
      places[i] = geocentric(lon, lat, t_.height(i));
    }
    sphere(places);
    if (t_.normals.size() == t_.u.size()) normals();
    for (Vec3& p : places) p = scaled(p);
    horizon(places);
  }

  void sphere(const std::vector<Vec3>& places) {
    constexpr double kRounding_m = 1e-4;
    const auto reach_from = [&](const Vec3& c) {
      double reach = 0;
      for (const Vec3& p : places) reach = std::max(reach, length(p - c));
      return reach;
    };
    const Vec3 middle = geocentric((rect_.west + rect_.east) / 2, (rect_.south + rect_.north) / 2,
                                   (t_.min_height + t_.max_height) / 2);
    const double needed = reach_from(middle);
    const double reach = reach_from({t_.sphere[0], t_.sphere[1], t_.sphere[2]});
    if (!(reach <= t_.sphere[3] + kRounding_m))
      report(rule("sphere.contains"),
             "a vertex is " + number(reach - t_.sphere[3]) + " m outside of it");
    else if (t_.sphere[3] > 2 * needed + 1)
      report(rule("sphere.loose"), number(t_.sphere[3]) + " m, needed " + number(needed) + " m");
    const Vec3 center{t_.center[0], t_.center[1], t_.center[2]};
    if (!(length(center - middle) <= needed))
      report(rule("center.inside"), number(length(center - middle)) + " m from the tile's middle");
  }

  /// The angle that an occlusion point in this direction must stand for, past a sphere of radius r.
  static double needed_angle(const Vec3& direction, const std::vector<Vec3>& places, double r) {
    double widest = 0;
    for (const Vec3& p : places)
      widest = std::max(widest, angle_between(direction, p) + horizon_angle(length(p), r));
    return widest;
  }

  void horizon(const std::vector<Vec3>& places) {
    constexpr double kTolerance = 1e-7;  // radians: 0.6 m on the ground
    constexpr double kAtInfinity = 1e8;  // no point can stand for more than a hemisphere
    constexpr double kMuchTooFar = 0.1;  // radians
    const Vec3 raw{t_.horizon[0], t_.horizon[1], t_.horizon[2]};
    const double largest = std::max({std::abs(raw.x), std::abs(raw.y), std::abs(raw.z)});
    if (!(largest > 0)) return report(rule("horizon.hides"), "it is zero");
    const Vec3 unit = raw * (1 / largest);  // its square may overflow
    const double size = largest * length(unit);
    double lowest = 1;
    for (const Vec3& p : places) lowest = std::min(lowest, length(p));
    const double needed = needed_angle(unit, places, 1);
    const double depth = horizon_angle(1, lowest);
    const double stands_for = horizon_angle(size, 1);
    if (needed < std::numbers::pi / 2 - 0.01 && size > 1e4 && size < kAtInfinity)
      return report(rule("horizon.scaled"), "its length is " + number(size));
    if (size > kAtInfinity && needed > std::numbers::pi / 2 - kTolerance - 2 * depth) return;
    if (stands_for < needed - kTolerance)
      report(rule("horizon.hides"),
             "up to " + number((needed - stands_for) / kDegree) + " degrees");
    else if (stands_for < needed_angle(unit, places, lowest) + depth - kTolerance)
      report(rule("horizon.depth"), "heights below zero need more");
    else if (stands_for > needed + 2 * depth + kMuchTooFar)
      report(rule("horizon.far"), number((stands_for - needed) / kDegree) + " degrees more");
  }

  void normals() {
    std::size_t down = 0;
    for (std::size_t i = 0; i < t_.normals.size(); ++i) {
      const double lon = (rect_.west + rect_.width() * t_.u[i] / kEnd) * kDegree;
      const double lat = (rect_.south + rect_.height() * t_.v[i] / kEnd) * kDegree;
      const Vec3 up{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
      constexpr double kCoding = 0.02;  // two bytes are good to a degree
      down += dot(octahedral(t_.normals[i]), up) < -kCoding;
    }
    if (down) report(rule("normal.down"), std::to_string(down) + " vertices");
  }

  /// The point of the octahedron |x| + |y| + |z| = 1 above or below a place in its square.
  static Vec3 octahedral(const std::array<std::uint8_t, 2>& code) {
    const double s = (2.0 * code[0] - 255) / 255, t = (2.0 * code[1] - 255) / 255;
    Vec3 n{s, t, 1 - std::abs(s) - std::abs(t)};
    if (n.z < 0) {
      n.x = std::copysign(1 - std::abs(t), s);
      n.y = std::copysign(1 - std::abs(s), t);
    }
    return n * (1 / length(n));
  }

  const CheckedTile& t_;
  const GeoRect rect_;
  const std::string where_;
  Findings& findings_;
};

StatedError stated_error(const CheckedTile& tile, TileId id, double error_factor,
                         Findings& findings) {
  StatedError stated;
  const std::string where = id.text();
  const auto json = json::parse<nlohmann::json>(tile.metadata);
  if (!tile.metadata.empty() && !json.is_object()) {
    findings.add(rule("ext.metadata"), where, "not a JSON object");
    return stated;
  }
  stated.geometric_error_m = json::number(json, "geometricerror");
  const auto* const value = json::member(json, "max_error_m");
  if (!value) {
    findings.add(rule("error.missing"), where, "");
    return stated;
  }
  if (json.contains("side")) {
    const auto& side = json["side"];
    const auto known = enum_named<Side>(side.is_string() ? side.get<std::string>() : "");
    if (known)
      stated.side = *known;
    else
      findings.add(rule("error.side"), where, side.dump());
  }
  if (const auto edge = json.find("edge_error_m"); edge != json.end()) {
    if (const auto error = json::as_number(*edge, 0, kLargest))
      stated.edge_error_m = error;
    else
      findings.add(rule("error.edge"), where, edge->dump());
  }
  const double budget = assumed_level_error(id.level) * error_factor;
  // Gaps are judged by it: one that says anything makes that judgement nothing.
  if (stated.edge_error_m && *stated.edge_error_m > 4 * budget)
    findings.add(rule("error.edge-large"), where,
                 number(*stated.edge_error_m) + " m, budget " + number(budget) + " m");
  const auto found = json::as_number(*value, 0, kLargest);
  if (!found) {
    findings.add(rule("error.value"), where, value->dump());
    return stated;
  }
  const double error = *found;
  stated.max_error_m = error;
  stated.exact = json.contains("error_kind") && json["error_kind"] == "exact";
  stated.residual_m = json::number(json, "residual_m");
  if (stated.geometric_error_m && *stated.geometric_error_m < error)
    findings.add(rule("error.geometric"), where, json["geometricerror"].dump());
  if (error > budget)
    findings.add(rule("error.budget"), where,
                 number(error) + " m, budget " + number(budget) + " m");
  return stated;
}

}  // namespace

double assumed_level_error(int level) {
  // A 65-sample heightmap across half the equator; two roots at level 0; a quarter of a sample.
  return 2 * std::numbers::pi * kA * 0.25 / (65 * 2) / std::exp2(level);
}

StatedError check_tile(const CheckedTile& tile, TileId id, double error_factor,
                       Findings& findings) {
  TileCheck(tile, id, findings).run();
  return stated_error(tile, id, error_factor, findings);
}

}  // namespace tind
