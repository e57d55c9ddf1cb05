#include "server/cli/options/polygon_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "terrain/raster/gdal/vectors/vector_source.h"

namespace tind::cli {

namespace {

/// Degrees that mean a post are rarely it to the last bit: whether posts on a box's sides count
/// must not hang on that.
double on_post(double x) {
  constexpr double kHair = 1e-6;  // posts
  return std::abs(x - std::round(x)) < kHair ? std::round(x) : x;
}

}  // namespace

Result<std::vector<NamedArea>> read_areas(const std::string& path, const DemSource& dem) {
  const auto shapes = read_vectors(path, dem);
  if (!shapes) return std::unexpected(shapes.error());
  if (shapes->polygons.empty())
    return fail(Errc::bad_data, path + ": has lines only; polygons are needed here");
  std::vector<NamedArea> out;
  for (const VectorPolygon& polygon : shapes->polygons) {
    if (out.empty() || out.back().feature != polygon.feature) out.push_back({polygon.feature, {}});
    for (const VectorLine& ring : polygon.rings) {
      std::vector<Vec2> points;
      for (const Vec3& p : ring) points.push_back({on_post(p.x), on_post(-p.y)});
      const auto placed = std::ranges::count_if(
          points, [](Vec2 p) { return std::isfinite(p.x) && std::isfinite(p.y); });
      if (placed == 0) continue;  // elsewhere on the globe
      if (std::size_t(placed) < points.size())
        return fail(Errc::bad_data,
                    fmt::format("{}: feature {}: {} of the {} corners of a ring have no place in "
                                "the DEM's CRS ({}), so nobody knows what it holds: cut it to "
                                "where that CRS is good",
                                path, polygon.feature, points.size() - std::size_t(placed),
                                points.size(), dem.info().crs_name));
      out.back().rings.push_back(std::move(points));
    }
  }
  return out;
}

}  // namespace tind::cli
