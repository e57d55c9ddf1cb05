#pragma once
// The reference system that a client names, and rectangles in it. Here x is always east (or right)
// and y north (or up), whatever order the system's authority has its axes in.

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/dataset/dataset.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/crs_points.h"

namespace tind::api::ogc {

/// x goes on beyond 180 degrees where a rectangle of longitudes crosses the antimeridian.
struct CrsBox {
  double west = 0, south = 0, east = 0, north = 0;

  double width() const { return east - west; }
  double height() const { return north - south; }
};

/// Thread-safe.
class AskedCrs {
 public:
  /// `name`: of crs_named(). The dataset's place decides between PROJ's ways to WGS84.
  /// invalid_argument as CrsPoints::make(). Tens of milliseconds, but for CRS84: on a worker.
  static Result<AskedCrs> make(const std::string& name, const DatasetFacts&);

  const std::string& name() const { return name_; }
  bool east_first() const { return !system_ || system_->east_first(); }
  bool geographic() const { return !system_ || system_->geographic(); }
  /// WKT 2, for files, whose numbers are east first anyway: of CRS84 that of EPSG:4326.
  std::string wkt() const;

  /// NaN where there is no such place, also for longitudes beyond a turn and latitudes beyond
  /// poles.
  void to_geographic(std::span<const Vec2> points, std::span<Geographic> out) const;
  std::vector<Geographic> to_geographic(std::span<const Vec2> points) const;
  void from_geographic(std::span<const Geographic> places, std::span<Vec2> out) const;
  /// Places on a rectangle's rim, as far as the system's map goes: Web Mercator's ends where it is
  /// square, at 85.06 degrees; the poles are infinitely far away.
  void keep_on_map(std::span<Geographic> places) const;

  /// What x grows by once around the globe, where it does so at any latitude: of degrees (or grads)
  /// and of Web Mercator; 0 of others.
  double turn() const { return turn_; }

  /// Two numbers as they stand in a request, in the order of the authority's axes.
  Vec2 point(std::array<double, 2> as_written) const;
  /// Four numbers as they stand in a request: the least of both axes, then the most.
  /// invalid_argument where it is no rectangle; of degrees, west may be greater than east.
  Result<CrsBox> box(std::array<double, 4> as_written) const;
  /// Of degrees: no wider than a turn, not beyond the poles.
  bool is_on_globe(const CrsBox&) const;

 private:
  std::string name_;
  std::shared_ptr<const CrsPoints> system_;  // null: CRS84
  double turn_ = 360;
};

/// Ground lengths of a rectangle, metres, by what a small step is worth in its middle. 0 where that
/// is no place.
Vec2 ground_m(const AskedCrs&, const CrsBox&);

/// The box in `to` around places on the rim of one in `from`, beyond the antimeridian where that
/// is; nothing where there are none.
std::optional<CrsBox> box_in(const CrsBox&, const AskedCrs& from, const AskedCrs& to);

/// Where the dataset lies, in that system.
Result<CrsBox> box_of(const AskedCrs&, const DatasetFacts&);

/// "7,46,8,47", or six numbers, of which the heights are dropped; nothing for what else there is.
std::optional<std::array<double, 4>> four_numbers(std::string_view text);

}  // namespace tind::api::ogc
