#pragma once
// Where the posts of a raster are on the globe.

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"

namespace tind::gdal {

class Frame {
 public:
  /// `cols` x `rows` posts at `post_to_crs` in `crs`; any CrsKind.
  static Result<Frame> make(const CrsFacts& crs, const Affine& post_to_crs, std::int64_t cols,
                            std::int64_t rows);

  /// As DemSource. REQUIRES: a CRS.
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const;
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const;
  /// As to_post, for a raster whose pixels are areas: the first column of one that goes around the
  /// globe begins half a pixel west of its post.
  void to_pixel(std::span<const Geographic> in, std::span<Vec2> out) const;
  bool plain() const { return plain_; }

  /// The grid's map; for a raster that goes around the globe its step is 360 degrees / period.
  const Affine& post_to_crs() const { return map_; }
  double period() const { return period_; }
  bool wraps() const { return wraps_; }
  /// Its latitude in units of the CRS, where that is geographic: 90 degrees, 100 grads.
  double pole() const { return full_turn_ / 4; }

  /// How well its places are known; exactly where it is plain or has no CRS.
  CrsWay crs_way() const { return transform_ ? transform_->way() : CrsWay{"", 0.0, ""}; }

  /// Whether any of some places all over a part of it is on the globe; without a CRS it is.
  bool touches_globe(const PostRect&) const;
  /// The least and the greatest coordinates of a part, in units of the CRS.
  std::pair<Vec2, Vec2> coordinates(const PostRect&) const;
  /// Whether these can be longitudes and latitudes, where the CRS has such: what reaches far beyond
  /// a pole, or around the globe and half around again, is metres that are called degrees.
  bool fits_globe(const PostRect&) const;
  GeoRect bounds() const;
  /// The bounding box of some of the posts: one, or two where it crosses the antimeridian.
  std::vector<GeoRect> extents(const PostRect&) const;
  /// Ground distance of neighbouring posts at the centre, metres: along columns' x, rows' y.
  Vec2 spacing_m() const;

 private:
  void find_period(const CrsFacts&);
  Geographic geographic(Vec2 post) const;
  void reach_antimeridian(std::span<const Geographic> in, std::span<Vec2> out) const;
  bool holds(Vec2 post) const;

  Affine map_;
  std::int64_t cols_ = 0, rows_ = 0;
  CrsKind kind_ = CrsKind::none;
  double unit_m_ = 1, turn_ = 0, period_ = 0;
  double full_turn_ = 360;  // in units of the CRS, where that is geographic
  bool plain_ = false, wraps_ = false;
  std::shared_ptr<const ToGeographic> transform_;  // null for plain or none
};

}  // namespace tind::gdal
