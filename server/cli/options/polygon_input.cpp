#include "server/cli/options/polygon_input.h"

#include <utility>

#include "terrain/raster/gdal/vector_source.h"

namespace tind::cli {

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
      for (const Vec3& p : ring) points.push_back({p.x, -p.y});
      out.back().rings.push_back(std::move(points));
    }
  }
  return out;
}

}  // namespace tind::cli
