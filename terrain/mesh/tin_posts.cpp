#include "terrain/mesh/tin_posts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "terrain/mesh/mesh_raster.h"
#include "terrain/mesh/vertical_error.h"

namespace tind {
namespace {

/// A length that is a whole number of steps but for rounding is not cut into one more.
constexpr double kWhole = 1e-6;

/// Steps along a side, as a number that may be too large for an integer.
double steps(double length_m, double spacing_m) {
  return std::max(1.0, std::ceil(length_m / spacing_m - kWhole));
}

/// To columns, rows (y = -row) and metres.
Tin on_posts(const Tin& tin, const Affine& post_to_tin, double z_unit_m) {
  Tin out{tin.vertices, tin.triangles, {}, {}, {}};
  for (Vec3& v : out.vertices) {
    const Vec2 post = post_to_tin.invert(v.x, v.y);
    v = {post.x, -post.y, v.z * z_unit_m};
  }
  return out;
}

}  // namespace

Result<TinPosts> tin_posts(const Tin& tin, const Vec3& unit_m, double spacing_m, int threads) {
  const auto [west, east] = std::ranges::minmax(tin.vertices, {}, &Vec3::x);
  const auto [south, north] = std::ranges::minmax(tin.vertices, {}, &Vec3::y);
  const double width = east.x - west.x, height = north.y - south.y;
  const double across = steps(width * unit_m.x, spacing_m);
  const double down = steps(height * unit_m.y, spacing_m);
  if (!((across + 1) * (down + 1) <= double(kMostTinPosts)))
    return fail(Errc::out_of_range,
                fmt::format("posts {:g} m apart are {:.0f} x {:.0f}, too many (at most {} million)",
                            spacing_m, across + 1, down + 1, kMostTinPosts / 1'000'000));
  TinPosts out;
  out.post_to_tin = {west.x, width / across, 0, north.y, 0, -height / down};
  const Tin mesh = on_posts(tin, out.post_to_tin, unit_m.z);
  const HeightGrid none(int(across) + 1, int(down) + 1);
  out.heights = mesh_raster(mesh, none, 0, threads).heights;
  const VerticalError at_posts = vertical_error(mesh, out.heights, threads);
  out.error = surface_error(mesh, out.heights, at_posts, threads);
  return out;
}

}  // namespace tind
