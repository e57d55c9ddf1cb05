#include "terrain/analysis/volume.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "terrain/analysis/heights_at.h"
#include "terrain/analysis/post_rows.h"
#include "terrain/raster/datums.h"

namespace tind {
namespace {

/// Of another DEM at the posts of a row.
Result<void> take_off(const DemSource& dem, const DemSource& other, std::int64_t row,
                      std::span<double> out) {
  std::vector<Vec2> posts;
  posts.reserve(out.size());
  for (std::size_t c = 0; c < out.size(); ++c) posts.push_back({double(c), double(row)});
  std::vector<Geographic> places(posts.size());
  dem.to_geographic(posts, places);
  const auto heights = heights_at(Surface(other), places, Interpolation::bilinear);
  if (!heights) return std::unexpected(heights.error());
  for (std::size_t c = 0; c < out.size(); ++c) {
    const HeightAt& h = (*heights)[c].height;
    out[c] -= h.coverage == Coverage::value ? h.height_m : std::numeric_limits<double>::quiet_NaN();
  }
  return {};
}

Result<void> comparable(const DemInfo& a, const DemInfo& b) {
  if (a.crs_kind == CrsKind::none || b.crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument, "two DEMs are compared by where they are, and " +
                                            (a.crs_kind == CrsKind::none ? a : b).files[0] +
                                            " has no CRS");
  const bool known = a.datum != VerticalDatum::unknown && b.datum != VerticalDatum::unknown;
  if (known && a.datum != b.datum)
    return fail(Errc::invalid_argument, "heights of one DEM are above " + name(a.datum) +
                                            ", of the other above " + name(b.datum) +
                                            ": bring both to one (--to-datum)");
  return {};
}

}  // namespace

Result<HeightPlane> plane_through(const std::array<Vec3, 3>& p) {
  const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
  if (!(std::abs(normal.z) > 1e-9))
    return fail(Errc::invalid_argument, "the three points of the plane lie on one line");
  const double x = -normal.x / normal.z, y = -normal.y / normal.z;
  return HeightPlane{p[0].z - x * p[0].x - y * p[0].y, x, y};
}

Result<PostRow> difference_rows(const DemSource& dem, const VolumeReference& reference) {
  auto rows = std::make_shared<PostRows>(dem);
  if (const auto* level = std::get_if<LevelReference>(&reference))
    return PostRow([rows, z = level->height_m](std::int64_t row, std::span<double> out) {
      auto read = (*rows)(row, out);
      for (double& v : out) v -= z;
      return read;
    });
  if (const auto* said = std::get_if<PlaneReference>(&reference)) {
    const auto plane = plane_through(said->through);
    if (!plane) return std::unexpected(plane.error());
    return PostRow([rows, p = *plane](std::int64_t row, std::span<double> out) {
      auto read = (*rows)(row, out);
      for (std::size_t c = 0; c < out.size(); ++c) out[c] -= p.at(double(c), double(row));
      return read;
    });
  }
  const auto other = std::get<DemReference>(reference).dem;
  if (auto ok = comparable(dem.info(), other->info()); !ok) return std::unexpected(ok.error());
  return PostRow([rows, &dem, other](std::int64_t row, std::span<double> out) -> Result<void> {
    if (auto read = (*rows)(row, out); !read) return read;
    return take_off(dem, *other, row, out);
  });
}

Result<Volume> volume(const DemSource& dem, const VolumeReference& reference, const PostRings& area,
                      double uncertainty_m, const Progress& progress) {
  const auto rows = difference_rows(dem, reference);
  if (!rows) return std::unexpected(rows.error());
  const auto made = integrate(dem.info(), area, *rows, uncertainty_m, progress);
  if (!made) return std::unexpected(made.error());
  const AreaIntegral& i = *made;
  const double net = i.above_m3 - i.below_m3, by = uncertainty_m * i.area_m2;
  return Volume{i.area_m2,
                i.void_area_m2,
                reaches_beyond(dem.info(), area),
                {i.above_m3, i.above_low_m3, i.above_high_m3},
                {i.below_m3, i.below_low_m3, i.below_high_m3},
                {net, net - by, net + by}};
}

}  // namespace tind
