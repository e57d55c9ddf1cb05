// A straight piece of a line over a triangle is clipped by its three sides: what each side has to
// say of a place is linear along the piece, and the three together, divided by the area, are the
// weights of the corners' heights there.

#include "terrain/analysis/tin_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "terrain/analysis/post_way.h"
#include "terrain/analysis/profile_points.h"
#include "terrain/mesh/triangle_locator.h"
#include "terrain/mesh/triangle_tree.h"
#include "terrain/raster/held_posts.h"

namespace tind {
namespace {

/// PROJ there and back is not exact: a place so near to a TIN's rim, metres, is on it.
constexpr double kRim_m = 1e-6;

/// What of a straight piece is over a triangle: t from 0 to 1, and heights there.
struct Over {
  double from, to, z_from, z_to;
};

using Corners = std::array<Vec3, 3>;

/// Over the triangle or nothing; p and q as its corners are: x right, y up.
std::optional<Over> clipped(const Corners& c, Vec2 p, Vec2 q) {
  double from = 0, to = 1;
  std::array<double, 3> at_p, at_q;
  for (std::size_t k = 0; k < 3; ++k) {  // of the side across from corner k
    const Vec3 &a = c[(k + 1) % 3], &b = c[(k + 2) % 3];
    at_p[k] = orient2d(a, b, {p.x, p.y, 0});
    at_q[k] = orient2d(a, b, {q.x, q.y, 0});
    const double rim = kRim_m * std::hypot(b.x - a.x, b.y - a.y);
    const double first = at_p[k] + rim, last = at_q[k] + rim;
    if (first < 0 && last < 0) return {};
    if (first < 0) from = std::max(from, first / (first - last));
    if (last < 0) to = std::min(to, first / (first - last));
  }
  if (!(from < to)) return {};
  const auto height = [&](double t) {
    double sum = 0, z = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double weight = std::max(0.0, at_p[k] + t * (at_q[k] - at_p[k]));
      sum += weight, z += weight * c[k].z;
    }
    return z / sum;
  };
  return Over{from, to, height(from), height(to)};
}

Corners corners_of(const Tin& tin, const Triangle& t) {
  return {tin.vertices[t[0]], tin.vertices[t[1]], tin.vertices[t[2]]};
}

/// The piece from a to b, `from_m` to `to_m` of the line.
void walk_piece(const TinGround& ground, const TriangleTree& tree, Vec2 a, Vec2 b, double from_m,
                double to_m, ProfilePoints& points) {
  const Vec2 p{a.x, -a.y}, q{b.x, -b.y};
  const PlaneBox box{{std::min(p.x, q.x) - kRim_m, std::min(p.y, q.y) - kRim_m},
                     {std::max(p.x, q.x) + kRim_m, std::max(p.y, q.y) + kRim_m}};
  std::vector<Over> all;
  tree.each_near(box, [&](std::uint32_t t) {
    if (const auto over = clipped(corners_of(ground.tin, ground.tin.triangles[t]), p, q))
      all.push_back(*over);
    return true;
  });
  std::ranges::sort(all, {}, [](const Over& o) { return std::pair(o.from, o.to); });
  const auto metres = [&](double t) { return from_m + t * (to_m - from_m); };
  double reached = 0;
  for (const Over& o : all) {
    if (metres(o.from) - metres(reached) > 2 * kRim_m) points.nothing_from(metres(reached));
    points.ground(metres(o.from), o.z_from);
    points.ground(metres(o.to), o.z_to);
    reached = std::max(reached, o.to);
  }
  if (metres(1) - metres(reached) > 2 * kRim_m) points.nothing_from(metres(reached));
}

Result<void> walk_leg(const TinGround& ground, const TriangleTree& tree, const GeodesicPath& path,
                      double from_m, double to_m, ProfilePoints& points,
                      const std::stop_token& stop) {
  const Curve curve = [&](std::span<const double> shares, std::span<Geographic> places) {
    for (std::size_t i = 0; i < shares.size(); ++i)
      places[i] = path.at(from_m + (to_m - from_m) * shares[i]);
  };
  const auto pieces = straight_pieces(*ground.frame, curve, kProfileTolerance_posts);
  if (!pieces) return std::unexpected(pieces.error());
  for (const WayPiece& p : *pieces) {
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    const double length = to_m - from_m;
    walk_piece(ground, tree, p.from, p.to, from_m + length * p.from_share,
               from_m + length * p.to_share, points);
    if (points.size() > kMostProfilePoints)
      return fail(Errc::out_of_range,
                  "the line crosses more than a million edges: ask for samples, or for a shorter "
                  "line");
  }
  return {};
}

/// Of a plane over an area, corners d above zero: the volume above and that below.
struct Halves {
  double above = 0, below = 0;
};
Halves halves_of(std::array<double, 3> d, double area) {
  std::ranges::sort(d);
  const double all = area * (d[0] + d[1] + d[2]) / 3;
  if (d[0] >= 0) return {all, 0};
  if (d[2] <= 0) return {0, -all};
  // The corner that is alone on its side cuts off a triangle similar in two sides.
  if (d[1] <= 0) {
    const double above = area * d[2] * d[2] * d[2] / (3 * (d[2] - d[0]) * (d[2] - d[1]));
    return {above, above - all};
  }
  const double below = -area * d[0] * d[0] * d[0] / (3 * (d[1] - d[0]) * (d[2] - d[0]));
  return {all + below, below};
}

/// Two legs of a triangle in the plane: half their cross product.
double area_of(const Corners& c) { return orient2d(c[0], c[1], c[2]) / 2; }

/// What heights are compared with.
Result<HeightPlane> plane_of(const std::variant<LevelReference, PlaneReference>& reference) {
  if (const auto* const level = std::get_if<LevelReference>(&reference))
    return HeightPlane{level->height_m, 0, 0};
  return plane_through(std::get<PlaneReference>(reference).through);
}

}  // namespace

Result<TinGround> tin_ground(Tin tin, const Vec3& unit_m, const std::string& name,
                             const std::string& crs, const VerticalDatum& datum,
                             const DemOptions& options) {
  const auto [west, east] = std::ranges::minmax(tin.vertices, {}, &Vec3::x);
  const double north = std::ranges::max(tin.vertices, {}, &Vec3::y).y;
  Affine map{west.x, 1 / unit_m.x, 0, north, 0, -1 / unit_m.y};
  const auto placed = [&] {
    return dem_of({name, "TIN", HeightGrid(2, 2), map, crs, datum}, options);
  };
  auto frame = placed();
  if (!frame) return std::unexpected(frame.error());
  if (!(*frame)->info().datum_way.empty())
    return fail(Errc::invalid_argument,
                name +
                    ": heights are brought to another datum at posts, and a TIN has none: leave "
                    "--to-datum out, or (of a profile, say) make posts with --posts METRES");
  // A longitude is taken for that of its turns which is nearest to the frame.
  const double cols = (east.x - west.x) * unit_m.x;
  if (cols > (*frame)->info().period_cols / 2 && (*frame)->info().period_cols > 0) {
    map.x0 += std::floor(cols / 2) * map.x_col;
    if (frame = placed(); !frame) return std::unexpected(frame.error());
  }
  for (Vec3& v : tin.vertices) {
    const Vec2 post = map.invert(v.x, v.y);
    v = {post.x, -post.y, v.z * unit_m.z};
  }
  return TinGround{std::move(tin), std::move(*frame)};
}

Result<std::vector<HeightAt>> heights_at(const TinGround& ground,
                                         std::span<const Geographic> places) {
  if (ground.frame->info().crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                ground.frame->info().files[0] +
                    ": has no CRS, so it is not known where a place on the globe lies in it: say "
                    "its CRS (--crs)");
  std::vector<Vec2> posts(places.size());
  ground.frame->to_post(places, posts);
  const TriangleLocator locator(ground.tin);
  std::vector<HeightAt> out(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    Vec2 at = posts[i];
    if (!std::isfinite(at.x) || !std::isfinite(at.y)) continue;
    for (double* x : {&at.x, &at.y})
      if (std::abs(*x - std::round(*x)) <= kRim_m) *x = std::round(*x);
    if (const auto z = locator.height_at({at.x, -at.y})) out[i] = {Coverage::value, *z};
  }
  return out;
}

Result<Profile> sampled_profile(const TinGround& ground, const GeodesicPath& path,
                                std::vector<double> distances) {
  std::vector<Geographic> places;
  places.reserve(distances.size());
  for (const double metres : distances) places.push_back(path.at(metres));
  const auto heights = heights_at(ground, places);
  if (!heights) return std::unexpected(heights.error());
  Profile out{path.length_m(), {}};
  for (std::size_t i = 0; i < distances.size(); ++i)
    out.points.push_back({distances[i], places[i], (*heights)[i]});
  return out;
}

Result<Profile> exact_profile(const TinGround& ground, const GeodesicPath& path,
                              const std::stop_token& stop) {
  const TriangleTree tree(ground.tin);
  ProfilePoints points(path);
  const auto reached = path.reached_m();
  for (std::size_t i = 1; i < reached.size(); ++i)
    if (reached[i] > reached[i - 1])
      if (auto done = walk_leg(ground, tree, path, reached[i - 1], reached[i], points, stop); !done)
        return std::unexpected(done.error());
  Profile out{path.length_m(), points.taken()};
  for (ProfilePoint& p : out.points)  // a TIN has no voids: where it is not, is outside
    if (p.height.coverage == Coverage::void_) p.height.coverage = Coverage::outside;
  return out;
}

Result<Volume> volume(const TinGround& ground,
                      const std::variant<LevelReference, PlaneReference>& reference,
                      double uncertainty_m) {
  if (ground.frame->info().crs_kind == CrsKind::geographic)
    return fail(Errc::unsupported,
                ground.frame->info().files[0] +
                    ": is in degrees, where triangles are no planes on the ground: say with "
                    "--posts how many metres apart its heights are to be taken");
  const auto plane = plane_of(reference);
  if (!plane) return std::unexpected(plane.error());
  Volume out;
  double& area_m2 = out.area_m2;
  for (const Triangle& t : ground.tin.triangles) {
    const Corners c = corners_of(ground.tin, t);
    const double area = area_of(c);  // posts are metres of the plane
    area_m2 += area;
    std::array<double, 3> d, lower, higher;
    for (std::size_t k = 0; k < 3; ++k) {
      d[k] = c[k].z - plane->at(c[k].x, -c[k].y);
      lower[k] = d[k] - uncertainty_m, higher[k] = d[k] + uncertainty_m;
    }
    const Halves as_is = halves_of(d, area);
    const Halves low = halves_of(lower, area), high = halves_of(higher, area);
    out.cut_m3.value += as_is.above, out.fill_m3.value += as_is.below;
    out.cut_m3.low += low.above, out.cut_m3.high += high.above;
    out.fill_m3.low += high.below, out.fill_m3.high += low.below;
  }
  const double net = out.cut_m3.value - out.fill_m3.value, by = uncertainty_m * area_m2;
  out.net_m3 = {net, net - by, net + by};
  return out;
}

}  // namespace tind
