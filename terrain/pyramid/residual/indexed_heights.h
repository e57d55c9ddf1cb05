#pragma once
// The terrain of a level as the residual index knows it, for what need not be exact: normals. Of a
// coarse tile they would otherwise ask for posts all over it, one block of the source for each.

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/pyramid/residual/residual_index.h"

namespace tind {

/// The surface of the lattices of all tiles of one level that rest on the index, as one: what H is
/// between its nodes. It depends on the index, the level and the place alone, so that tiles which
/// share an edge agree on it. For one thread; a record of the index is read when a place first asks
/// for it. Longitudes may run past +-180, latitudes not past +-90.
class IndexedHeights {
 public:
  IndexedHeights(const ResidualIndex& index, int level);

  /// Does the tile there rest on the index? Else the posts say what there is. Never, or of one DEM
  /// everywhere, where the level lies above that of the index.
  bool covers(Geographic place) const;

  /// NaN where the cells around hold no post. REQUIRES: covers() each.
  void at(std::span<const Geographic> places, std::span<double> heights);

  /// The first record that could not be read.
  const std::optional<Error>& error() const { return error_; }

 private:
  const ResidualIndex& index_;
  int level_;  // of the tiles
  double step_m_;
  std::map<TileId, std::shared_ptr<const ResidualRecord>> records_;  // null: without posts
  std::optional<Error> error_;

  const ResidualRecord* record(TileId);
  double at(Geographic place);
  std::optional<double> in_cell(int level, std::int64_t col, std::int64_t row, double east,
                                double south);
};

}  // namespace tind
