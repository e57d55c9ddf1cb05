// PROJ brings axes into the order of GIS where it transforms places. It is asked for the same here,
// so that both mean the same by x and y.

#include <proj.h>

#include <memory>
#include <optional>
#include <string_view>

#include "terrain/raster/crs_axes.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/crs/proj_operation.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind {
namespace {

struct Destroy {
  void operator()(PJ* pj) const { proj_destroy(pj); }
};
using Object = std::unique_ptr<PJ, Destroy>;

/// A shift of its datum may stand around the system that has the axes.
Object without_shift(PJ_CONTEXT* context, Object crs) {
  while (crs && proj_get_type(crs.get()) == PJ_TYPE_BOUND_CRS)
    crs.reset(proj_get_source_crs(context, crs.get()));
  return crs;
}

/// Nothing for "unspecified" and for what leads along no side of the grid.
std::optional<Vec2> direction(PJ_CONTEXT* context, const PJ* system, int axis) {
  const char* to = nullptr;
  if (!proj_cs_get_axis_info(context, system, axis, nullptr, nullptr, &to, nullptr, nullptr,
                             nullptr, nullptr) ||
      !to)
    return {};
  const std::string_view way = to;
  if (way == "east") return Vec2{1, 0};
  if (way == "west") return Vec2{-1, 0};
  if (way == "north") return Vec2{0, 1};
  if (way == "south") return Vec2{0, -1};
  return {};
}

}  // namespace

Result<CrsAxes> crs_axes(const std::string& wkt) {
  if (wkt.empty()) return CrsAxes{};
  gdal::set_up();
  const gdal::Operation any;  // for its context
  Object crs = without_shift(any.context, Object(proj_create(any.context, wkt.c_str())));
  if (crs) crs.reset(proj_normalize_for_visualization(any.context, crs.get()));
  const Object system(crs ? proj_crs_get_coordinate_system(any.context, crs.get()) : nullptr);
  if (!system) {
    if (auto there = gdal::crs_database(); !there) return std::unexpected(there.error());
    return CrsAxes{};
  }
  const auto x = direction(any.context, system.get(), 0),
             y = direction(any.context, system.get(), 1);
  if (!x || !y || x->x * y->y - x->y * y->x == 0) return CrsAxes{};
  return CrsAxes{*x, *y};
}

}  // namespace tind
