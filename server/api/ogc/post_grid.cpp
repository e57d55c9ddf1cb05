#include "server/api/ogc/post_grid.h"

#include <algorithm>
#include <cmath>

namespace tind::api::ogc {

PostGrid::PostGrid(const AskedCrs& crs, const Surface& surface)
    : PostGrid(Vec2{surface.info().spacing_x_m, surface.info().spacing_y_m}) {
  if (!surface.only() || !crs.geographic()) return;
  const DemInfo& info = surface.layers()[0].source->info();
  const Affine& a = info.post_to_crs;
  if (info.crs_kind != CrsKind::geographic || a.x_row != 0 || a.y_col != 0) return;
  // The DEM's own units may be others, grads.
  const double unit = crs.turn() / (info.period_cols * std::abs(a.x_col));
  step_ = {std::abs(a.x_col) * unit, std::abs(a.y_row) * unit};
  wraps_ = info.wraps_longitude;
  edge_ = a.x0 * unit - step_.x / 2;
}

Vec2 PostGrid::pixels(const CrsBox& box, Vec2 ground) const {
  if (step_.x > 0) return {box.width() / step_.x, box.height() / step_.y};
  return {ground.x / spacing_m_.x, ground.y / spacing_m_.y};
}

CrsBox PostGrid::around(const AskedCrs& crs, const CrsBox& posts) const {
  const Vec2 all = pixels(posts, ground_m(crs, posts));
  const double x = posts.width() / std::max(1., std::round(all.x)) / 2;
  const double y = posts.height() / std::max(1., std::round(all.y)) / 2;
  CrsBox box{posts.west - x, posts.south - y, posts.east + x, posts.north + y};
  if (!crs.geographic()) return box;
  // Around the globe the first column and the one behind the last are the same.
  box.east = std::min(box.east, box.west + crs.turn());
  if (wraps_ && posts.width() >= crs.turn()) {
    // The edge between two pixels that is the antimeridian, or the next one to the west of it.
    const double half = crs.turn() / 2;
    const double beyond = std::remainder(edge_ + half, step_.x);
    const double west = std::abs(beyond) < 1e-6 * step_.x ? 0
                        : beyond > 0                      ? beyond - step_.x
                                                          : beyond;
    box.west = west - half, box.east = west + half;
  }
  const double pole = crs.turn() / 4;
  box.south = std::max(box.south, -pole), box.north = std::min(box.north, pole);
  return box;
}

}  // namespace tind::api::ogc
