// What rounding does to the error, in the tile's own frame, which is the certificate's: a vertex is
// moved by at most d metres, up or aside; where the surface is as steep as its steepest triangle,
// moving it aside by d changes the height at a place by at most d times that slope.

#include "terrain/encode/glb_tile.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "proto/glb.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/tile/normals.h"

namespace tind {
namespace {

/// Metres to a unit of the tile's grid, the fewest at a triangle's vertices. At a pole, where all
/// longitudes are one place, nothing is moved along u.
struct Scale {
  double u = HUGE_VAL, v = HUGE_VAL;
};

Scale scale_of(const GeoRect& rect, const Tin& mesh, const Triangle& triangle) {
  Scale scale;
  for (const std::uint32_t i : triangle) {
    const Geographic p = place_of(rect, mesh.vertices[i]);
    const Vec2 degree = wgs84::metres_per_degree(p.lat);
    scale.v = std::min(scale.v, degree.y * rect.height() / kTileExtent);
    if (std::abs(p.lat) < 90) scale.u = std::min(scale.u, degree.x * rect.width() / kTileExtent);
  }
  return scale;
}

/// The steepest that a triangle is: metres up for a metre east, plus those for a metre north.
double steepest(const TileModel& tile) {
  const GeoRect rect = tiling::rect(tile.id);
  double most = 0;
  for (const Triangle& triangle : tile.mesh.triangles) {
    const Vec3& a = tile.mesh.vertices[triangle[0]];
    const Vec3 p = tile.mesh.vertices[triangle[1]] - a, q = tile.mesh.vertices[triangle[2]] - a;
    const double area = p.x * q.y - q.x * p.y;  // positive: counter-clockwise
    const Scale scale = scale_of(rect, tile.mesh, triangle);
    const double along_u = std::abs(p.z * q.y - q.z * p.y) / area / scale.u;
    const double along_v = std::abs(q.z * p.x - p.z * q.x) / area / scale.v;
    most = std::max(most, along_u + along_v);
  }
  return most;
}

/// Upwards to a micrometre, as the certificate's own figures are.
double round_up(double x) { return std::ceil(x * 1e6) / 1e6; }

std::string extras_of(const TileModel& tile, double moved) {
  nlohmann::ordered_json extras;
  if (tile.certificate) {
    extras["max_error_m"] = round_up(tile.certificate->max_error_m + moved * (1 + steepest(tile)));
    extras["error_kind"] = "bound";
  }
  extras["rounding_m"] = round_up(moved);
  extras["tile"] = tile.id.text();
  return extras.dump();
}

}  // namespace

std::vector<std::uint8_t> encode_glb(const TileModel& tile) {
  const Vec3& center = tile.volumes.center;
  const GeoRect rect = tiling::rect(tile.id);
  proto::Glb glb;
  glb.origin = {center.x, center.y, center.z};
  double moved = 0;
  for (const Vec3& v : tile.mesh.vertices) {
    const Vec3 exact = wgs84::to_ecef(place_of(rect, v), v.z) - center;
    const std::array<float, 3> at = {float(exact.x), float(exact.y), float(exact.z)};
    moved = std::max(moved, length(Vec3{at[0], at[1], at[2]} - exact));
    glb.positions.push_back(at);
  }
  for (const auto& oct : tile.normals) {
    const Vec3 n = oct_decode(oct);
    glb.normals.push_back({float(n.x), float(n.y), float(n.z)});
  }
  glb.triangles.assign(tile.mesh.triangles.begin(), tile.mesh.triangles.end());
  glb.extras = extras_of(tile, moved);
  return proto::encode(glb);
}

}  // namespace tind
