#include "terrain/pyramid/residual/indexed_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tind {

namespace {

constexpr int kCells = ResidualRecord::kCells, kNodes = ResidualRecord::kNodes;

Geographic in_first_turn(Geographic place) {
  if (place.lon < -180) place.lon += 360;
  if (place.lon >= 180) place.lon -= 360;
  return place;
}

}  // namespace

IndexedHeights::IndexedHeights(const ResidualIndex& index, int level)
    : index_(index), level_(level), step_m_(index.depth().step_m()) {}

bool IndexedHeights::covers(Geographic place) const {
  return index_.lattice_level(level_, in_first_turn(place)) >= 0;
}

const ResidualRecord* IndexedHeights::record(TileId id) {
  if (const auto there = records_.find(id); there != records_.end()) return there->second.get();
  auto found = index_.record(id);
  if (!found && found.error().code != Errc::not_found && !error_)
    error_ = found.error();  // what is not found, the source does not touch
  const bool useful = found && (*found)->has_posts();
  return records_.emplace(id, useful ? std::move(*found) : nullptr).first->second.get();
}

/// The surface in a cell, counted from the north-western corner of the world, `east` and `south` of
/// the way through it. Nothing where the cell has no post.
std::optional<double> IndexedHeights::in_cell(int level, std::int64_t col, std::int64_t row,
                                              double east, double south) {
  const ResidualRecord* const r = record(
      {level, std::uint32_t(col / kCells), tiling::rows(level) - 1 - std::uint32_t(row / kCells)});
  const auto i = std::size_t(col % kCells), j = std::size_t(row % kCells);
  if (!r || r->pieces[0][j * kCells + i] < 0) return {};
  const std::int32_t* const north = &r->heights[j * kNodes + i];
  const std::int32_t* const below = north + kNodes;
  const LatticeCell cell{below[0] * step_m_, below[1] * step_m_, north[0] * step_m_,
                         north[1] * step_m_};
  return cell.at(east, 1 - south);
}

double IndexedHeights::at(Geographic place) {
  place = in_first_turn(place);
  const int level = index_.lattice_level(level_, place);  // of the records
  const double per_degree = kCells / tiling::tile_degrees(level);
  const std::int64_t cols = std::int64_t(tiling::columns(level)) * kCells,
                     rows = std::int64_t(tiling::rows(level)) * kCells;
  const double x = (place.lon + 180) * per_degree, y = (90 - place.lat) * per_degree;
  const auto col = std::min(std::int64_t(x), cols - 1), row = std::min(std::int64_t(y), rows - 1);
  // A place on a line belongs to the cells on both sides: of those with posts, any.
  const bool on_west = x == double(col), on_north = y == double(row) && row > 0;
  for (const int up : {0, 1})
    for (const int left : {0, 1}) {
      if ((up && !on_north) || (left && !on_west)) continue;
      const auto height = in_cell(level, (col - left + cols) % cols, row - up,
                                  x - double(col) + left, y - double(row) + up);
      if (height) return *height;
    }
  return std::numeric_limits<double>::quiet_NaN();
}

void IndexedHeights::at(std::span<const Geographic> places, std::span<double> heights) {
  for (std::size_t i = 0; i < places.size(); ++i) heights[i] = at(places[i]);
}

}  // namespace tind
