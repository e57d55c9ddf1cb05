#include "terrain/pyramid/residual/indexed_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tind {

namespace {

constexpr int kCells = ResidualRecord::kCells, kNodes = ResidualRecord::kNodes;

}  // namespace

IndexedHeights::IndexedHeights(const ResidualIndex& index, int level)
    : index_(index), level_(index.lattice_level(level)), step_m_(residual_step_m(index.level())) {}

const IndexedHeights::Part& IndexedHeights::part(TileId id) {
  if (const auto there = parts_.find(id); there != parts_.end()) return there->second;
  Part part;
  auto record = index_.record(id);
  if (record && record->has_posts()) {
    part.heights = std::move(record->heights);
    for (const float residual : record->pieces[0]) part.has_post.push_back(residual >= 0);
  } else if (!record && record.error().code != Errc::not_found && !error_) {
    error_ = record.error();  // what is not found, the source does not touch
  }
  return parts_.emplace(id, std::move(part)).first->second;
}

/// The surface in a cell, counted from the north-western corner of the world, `east` and `south` of
/// the way through it. Nothing where the cell has no post.
std::optional<double> IndexedHeights::in_cell(std::int64_t col, std::int64_t row, double east,
                                              double south) {
  const Part& p = part({level_, std::uint32_t(col / kCells),
                        tiling::rows(level_) - 1 - std::uint32_t(row / kCells)});
  const auto i = std::size_t(col % kCells), j = std::size_t(row % kCells);
  if (p.heights.empty() || !p.has_post[j * kCells + i]) return {};
  const std::int32_t* const north = &p.heights[j * kNodes + i];
  const std::int32_t* const below = north + kNodes;
  const LatticeCell cell{below[0] * step_m_, below[1] * step_m_, north[0] * step_m_,
                         north[1] * step_m_};
  return cell.at(east, 1 - south);
}

double IndexedHeights::at(Geographic place) {
  if (place.lon < -180) place.lon += 360;
  if (place.lon >= 180) place.lon -= 360;
  const double per_degree = kCells / tiling::tile_degrees(level_);
  const std::int64_t cols = std::int64_t(tiling::columns(level_)) * kCells,
                     rows = std::int64_t(tiling::rows(level_)) * kCells;
  const double x = (place.lon + 180) * per_degree, y = (90 - place.lat) * per_degree;
  const auto col = std::min(std::int64_t(x), cols - 1), row = std::min(std::int64_t(y), rows - 1);
  // A place on a line belongs to the cells on both sides: of those with posts, any.
  const bool on_west = x == double(col), on_north = y == double(row) && row > 0;
  for (const int up : {0, 1})
    for (const int left : {0, 1}) {
      if ((up && !on_north) || (left && !on_west)) continue;
      const auto height = in_cell((col - left + cols) % cols, row - up, x - double(col) + left,
                                  y - double(row) + up);
      if (height) return *height;
    }
  return std::numeric_limits<double>::quiet_NaN();
}

void IndexedHeights::at(std::span<const Geographic> places, std::span<double> heights) {
  for (std::size_t i = 0; i < places.size(); ++i) heights[i] = at(places[i]);
}

}  // namespace tind
