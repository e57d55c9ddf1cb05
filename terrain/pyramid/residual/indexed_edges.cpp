#include "terrain/pyramid/residual/indexed_edges.h"

#include <cmath>

#include "terrain/surface/post_warp.h"

namespace tind {

namespace {

constexpr int kCells = ResidualRecord::kCells;

}  // namespace

Result<const ResidualHead*> IndexedEdges::heights_of(TileId id) {
  if (id != last_id_) {
    auto found = index_.head(id);
    if (!found && found.error().code != Errc::not_found) return std::unexpected(found.error());
    last_id_ = id;
    last_ = found && (*found)->has_heights ? std::move(*found) : nullptr;
  }
  return last_.get();
}

/// In steps; counted from the south-western corner of the world, in cells of records of a level.
/// Of the records that it lies in the first that has heights says it, the one to its north-east
/// first; where none has, it is 0. REQUIRES: on a line between tiles of the level.
Result<std::int32_t> IndexedEdges::node(int level, std::int64_t east, std::int64_t north) {
  const std::int64_t columns = tiling::columns(level), rows = tiling::rows(level);
  for (const int south : {0, 1})
    for (const int west : {0, 1}) {
      // On a line between tiles it lies in both, else in one.
      if ((south && north % kCells != 0) || (west && east % kCells != 0)) continue;
      const std::int64_t x = (east / kCells - west + columns) % columns, y = north / kCells - south;
      if (y < 0 || y >= rows) continue;
      const auto head = heights_of({level, std::uint32_t(x), std::uint32_t(y)});
      if (!head) return std::unexpected(head.error());
      if (!*head) continue;
      const int col = west ? kCells : int(east % kCells);
      const int row = south ? 0 : kCells - int(north % kCells);
      if (row == 0) return (*head)->north[std::size_t(col)];
      if (row == kCells) return (*head)->south[std::size_t(col)];
      return (col == 0 ? (*head)->west : (*head)->east)[std::size_t(row)];
    }
  return 0;
}

Result<EdgeProfile> IndexedEdges::profile(TileId id, TileSide side) {
  const int down = index_.finer(id.level), level = id.level + down, cells = kCells << down;
  const std::int64_t around = std::int64_t(tiling::columns(level)) * kCells;
  const bool upright = side == TileSide::west || side == TileSide::east;
  std::int64_t east = std::int64_t(id.x + (side == TileSide::east)) * cells,
               north = std::int64_t(id.y + (side == TileSide::north)) * cells;
  EdgeProfile found;
  for (int i = 0; i <= cells; ++i) {
    const auto height = node(level, east % around, north);
    if (!height) return std::unexpected(height.error());
    found.at.push_back(std::round(double(i) * kTileExtent / cells));
    found.h.push_back(*height * index_.depth().step_m());
    ++(upright ? north : east);
  }
  return found;
}

}  // namespace tind
