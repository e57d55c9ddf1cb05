#pragma once
// Posts of a DEM in polygons: which window of posts a polygon can touch, and which posts of a
// window are inside.

#include <cstdint>
#include <vector>

#include "terrain/raster/dem_source.h"
#include "terrain/shapes/area_set.h"

namespace tind {

/// The posts that a box can hold. Of a wrapping source the columns may go around: -period .. 2
/// period, so posts may be in two of them.
std::vector<PostRect> post_rects(const DemSource&, const GeoRect& degrees);

/// Calls f(k, lon, lat) for the posts (col + k % cols * step, row + k / cols * step), row by row.
template <class F>
void each_post_place(const DemSource& source, std::int64_t col, std::int64_t row, int cols,
                     int rows, int step, F&& f) {
  std::vector<Vec2> posts(static_cast<std::size_t>(cols));
  std::vector<Geographic> places(posts.size());
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < cols; ++i)
      posts[std::size_t(i)] = {double(col + std::int64_t(i) * step),
                               double(row + std::int64_t(j) * step)};
    source.to_geographic(posts, places);
    for (int i = 0; i < cols; ++i) {
      const Geographic& p = places[std::size_t(i)];
      f(std::size_t(j) * std::size_t(cols) + std::size_t(i),
        p.lon > 180    ? p.lon - 360
        : p.lon < -180 ? p.lon + 360
                       : p.lon,
        p.lat);
    }
  }
}

/// Which polygon holds a place, fast for places that follow each other on one parallel.
class AreaRow {
 public:
  AreaRow(const AreaSet& areas, const DemSource& source)
      : areas_(areas), by_rows_(source.is_plain_geographic()) {}
  /// The lowest number, or AreaSet::kNone.
  std::uint32_t holding(double lon, double lat);

 private:
  const AreaSet& areas_;
  bool by_rows_;  // else every place has a parallel of its own
  double lat_ = HUGE_VAL;
  std::vector<AreaSet::Span> spans_;
  std::vector<double> ends_;            // where what holds a place can change
  std::vector<std::uint32_t> between_;  // what does, up to each end
  std::vector<std::size_t> next_;       // from each on, a stretch that nothing has yet, or a hint
  std::size_t at_ = 0;
};

}  // namespace tind
