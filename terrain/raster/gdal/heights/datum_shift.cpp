#include "terrain/raster/gdal/heights/datum_shift.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "terrain/geo/longitude.h"

namespace tind {
namespace {

constexpr int kCell = 8;                 // posts a side
constexpr double kFineSpacing = 100;     // metres
constexpr double kLargestLatitude = 80;  // beyond, longitude bends too much

std::int64_t cell_of(std::int64_t post) {
  return post >= 0 ? post / kCell : (post - kCell + 1) / kCell;
}

Geographic between(const Geographic& a, const Geographic& b, double f) {
  return {a.lon + (b.lon - a.lon) * f, a.lat + (b.lat - a.lat) * f};
}

/// All of them in the turn of the first, so that what lies between two across the antimeridian lies
/// there, not on the other side of the globe.
void unwrap(std::span<Geographic> places) {
  double first = NAN;
  for (Geographic& p : places) {
    if (std::isnan(first)) first = p.lon;
    if (std::abs(p.lon - first) > 180) p.lon -= 360 * std::round((p.lon - first) / 360);
  }
}

}  // namespace

DatumShift::DatumShift(std::shared_ptr<const DatumSurface> from,
                       std::shared_ptr<const DatumSurface> to, const gdal::Frame& frame,
                       double unit_m)
    : from_(std::move(from)), to_(std::move(to)), frame_(frame), unit_m_(unit_m) {
  const Vec2 spacing = frame.spacing_m();
  const GeoRect bounds = frame.bounds();
  const bool bends =
      bounds.width() > 180 || bounds.north > kLargestLatitude || bounds.south < -kLargestLatitude;
  by_cells_ = !frame.plain() && !bends && std::max(spacing.x, spacing.y) <= kFineSpacing;
}

Result<void> DatumShift::add(std::int64_t col, std::int64_t row, int cols, int rows,
                             std::span<double> heights) const {
  return by_cells_ ? add_by_cells(col, row, cols, rows, heights)
                   : add_each(col, row, cols, rows, heights);
}

Result<void> DatumShift::add_row(std::span<const Geographic> places,
                                 std::span<double> heights) const {
  std::vector<std::size_t> valid;
  std::vector<Geographic> where;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (std::isnan(heights[i])) continue;
    valid.push_back(i);
    where.push_back(places[i]);
  }
  std::vector<double> undulations(valid.size());
  const auto apply = [&](const DatumSurface& surface, double sign) -> Result<void> {
    surface.undulations(where, undulations);
    for (std::size_t k = 0; k < valid.size(); ++k) {
      if (std::isnan(undulations[k]) && !std::isnan(where[k].lat))
        return fail(Errc::out_of_range,
                    fmt::format("there is a height at longitude {:.6f}, latitude {:.6f}, where {} "
                                "has none to convert it with",
                                where[k].lon, where[k].lat, surface.way()));
      heights[valid[k]] += sign * undulations[k] / unit_m_;
    }
    return {};
  };
  if (from_)
    if (auto ok = apply(*from_, 1); !ok) return ok;
  if (to_)
    if (auto ok = apply(*to_, -1); !ok) return ok;
  return {};
}

Result<void> DatumShift::add_each(std::int64_t col, std::int64_t row, int cols, int rows,
                                  std::span<double> heights) const {
  std::vector<Vec2> posts(cols);
  std::vector<Geographic> places(cols);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) posts[c] = {double(col + c), double(row + r)};
    frame_.to_geographic(posts, places);
    if (auto ok = add_row(places, heights.subspan(std::size_t(r) * cols, cols)); !ok) return ok;
  }
  return {};
}

Result<void> DatumShift::add_by_cells(std::int64_t col, std::int64_t row, int cols, int rows,
                                      std::span<double> heights) const {
  const std::int64_t c0 = cell_of(col), r0 = cell_of(row);
  const int nodes_x = int(cell_of(col + cols - 1) - c0) + 2;
  const int nodes_y = int(cell_of(row + rows - 1) - r0) + 2;
  std::vector<Vec2> posts(std::size_t(nodes_x) * nodes_y);
  std::vector<Geographic> nodes(posts.size()), places(cols);
  for (int y = 0; y < nodes_y; ++y)
    for (int x = 0; x < nodes_x; ++x)
      posts[std::size_t(y) * nodes_x + x] = {double((c0 + x) * kCell), double((r0 + y) * kCell)};
  frame_.to_geographic(posts, nodes);
  unwrap(nodes);
  for (int r = 0; r < rows; ++r) {
    const std::int64_t y = cell_of(row + r) - r0;
    const double fy = double(row + r - (r0 + y) * kCell) / kCell;
    for (int c = 0; c < cols; ++c) {
      const std::int64_t x = cell_of(col + c) - c0;
      const double fx = double(col + c - (c0 + x) * kCell) / kCell;
      const Geographic* north = &nodes[std::size_t(y) * nodes_x + std::size_t(x)];
      const Geographic* south = north + nodes_x;
      places[c] = within_first_turn(
          between(between(north[0], north[1], fx), between(south[0], south[1], fx), fy));
    }
    if (auto ok = add_row(places, heights.subspan(std::size_t(r) * cols, cols)); !ok) return ok;
  }
  return {};
}

}  // namespace tind
