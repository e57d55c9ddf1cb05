#include "terrain/analysis/zonal.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "terrain/analysis/post_rows.h"
#include "terrain/raster/dem_window.h"

namespace tind {
namespace {

/// The posts around the polygon; nothing where there are none.
std::optional<PostRect> rect_around(const DemInfo& info, const PostRings& rings) {
  double west = 1e18, east = -1e18, north = 1e18, south = -1e18;
  for (const auto& ring : rings)
    for (const Vec2& p : ring) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
      west = std::min(west, p.x), east = std::max(east, p.x);
      north = std::min(north, p.y), south = std::max(south, p.y);
    }
  west = std::max(std::floor(west), 0.0), north = std::max(std::floor(north), 0.0);
  east = std::min(std::ceil(east), double(info.cols - 1));
  south = std::min(std::ceil(south), double(info.rows - 1));
  if (!(west <= east && north <= south)) return {};
  return PostRect{std::int64_t(west), std::int64_t(north), std::int64_t(east), std::int64_t(south)};
}

/// Where edges cross a row of posts, by column; of those that end on it the ones to its south, or
/// its north where rows go that way. The same of an edge whichever ring has it.
std::vector<double> crossings(const PostRings& rings, double row, bool northward) {
  std::vector<double> out;
  const auto before = [&](double y) { return northward ? y < row : y <= row; };
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      Vec2 a = ring[i], b = ring[(i + 1) % ring.size()];
      if (before(a.y) == before(b.y)) continue;
      if (a.y > b.y) std::swap(a, b);
      out.push_back(a.x + (b.x - a.x) * ((row - a.y) / (b.y - a.y)));
    }
  std::ranges::sort(out);
  return out;
}

/// Of the values, which come out sorted.
void summarise(std::vector<float>& values, ZonalStatistics& out) {
  out.posts = values.size();
  if (values.empty()) return;
  std::ranges::sort(values);
  double sum = 0, squares = 0;
  for (const float v : values) sum += v;
  out.mean_m = sum / double(values.size());
  for (const float v : values) squares += (v - out.mean_m) * (v - out.mean_m);
  out.std_m = std::sqrt(squares / double(values.size()));
  out.min_m = values.front(), out.max_m = values.back();
  const std::size_t half = values.size() / 2;
  out.median_m = values.size() % 2 ? double(values[half])
                                   : (double(values[half - 1]) + double(values[half])) / 2;
}

}  // namespace

Result<ZonalStatistics> zonal_statistics(std::shared_ptr<const DemSource> dem,
                                         const PostRings& polygon, double base_m) {
  ZonalStatistics out;
  out.beyond = reaches_beyond(dem->info(), polygon);
  const auto rect = rect_around(dem->info(), polygon);
  if (!rect) return out;
  // "On an edge counts to the east and the south" is said of the map, however rows are stored; and
  // a meridian that a DEM has twice counts once.
  const Affine& map = dem->info().post_to_crs;
  const bool westward = map.x_col < 0;
  const bool northward = map.y_row > 0;
  std::int64_t last_col = rect->last_col;
  if (dem->info().wraps_longitude)
    last_col = std::min<std::int64_t>(last_col, std::llround(dem->info().period_cols) - 1);
  const double last = double(last_col - rect->col);
  const auto window = dem_window(std::move(dem), *rect);
  PostRings rings = polygon;
  for (auto& ring : rings)
    for (Vec2& p : ring) p.x -= double(rect->col), p.y -= double(rect->row);
  PostRows rows(*window);
  const DemInfo& info = window->info();
  std::vector<float> values;
  std::vector<double> row(std::size_t(info.cols));
  for (std::int64_t r = 0; r < info.rows; ++r) {
    const std::vector<double> xs = crossings(rings, double(r), northward);
    if (xs.empty()) continue;
    if (auto read = rows(r, row); !read) return std::unexpected(read.error());
    for (std::size_t k = 0; k + 1 < xs.size(); k += 2) {
      const double from = westward ? std::floor(xs[k]) + 1 : std::ceil(xs[k]),
                   to = westward ? std::floor(xs[k + 1]) : std::ceil(xs[k + 1]) - 1;
      // Whole numbers, which a double counts without rounding.
      // NOLINTNEXTLINE(clang-analyzer-security.FloatLoopCounter)
      for (double c = std::max(0.0, from); c <= std::min(to, last); ++c) {
        const double z = row[std::size_t(c)];
        if (std::isnan(z))
          ++out.voids;
        else
          values.push_back(float(z));
      }
    }
  }
  summarise(values, out);
  PostRows again(*window);
  const auto above = [&](std::int64_t r, std::span<double> z) {
    auto read = again(r, z);
    for (double& v : z) v -= base_m;
    return read;
  };
  const auto integral = integrate(info, rings, above);
  if (!integral) return std::unexpected(integral.error());
  out.area_m2 = integral->area_m2, out.void_area_m2 = integral->void_area_m2;
  out.volume_m3 = integral->above_m3 - integral->below_m3;
  if (out.area_m2 > 0) out.surface_mean_m = base_m + out.volume_m3 / out.area_m2;
  return out;
}

}  // namespace tind
