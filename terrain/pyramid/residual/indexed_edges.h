#pragma once
// Edges of tiles that rest on the residual index, from its nodes: a coarse tile's edge asks for
// heights along half a continent, which would be a block of the source for each.

#include <memory>
#include <optional>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/tile/border.h"

namespace tind {

/// The heights of the index's nodes, each one number, whichever of the records it lies in are
/// asked: so all tiles that meet at an edge or a corner know the same. The antimeridian is one
/// line. For one thread. REQUIRES: an index of one DEM.
class IndexedEdges {
 public:
  explicit IndexedEdges(const ResidualIndex& index) : index_(index) {}

  /// Of a side of a tile: the nodes of the records two levels further down, 1024 cells a side or
  /// less. Each is within half a step of H, voids filled
  /// (IndexDepth::step_m). REQUIRES: a level above that of the index.
  Result<EdgeProfile> profile(TileId, TileSide);

 private:
  using Head = std::shared_ptr<const ResidualHead>;
  const ResidualIndex& index_;
  TileId last_id_{-1, 0, 0};
  Head last_;  // null: the source does not touch it, or it has no heights

  Result<const ResidualHead*> heights_of(TileId);
  Result<std::int32_t> node(int level, std::int64_t east, std::int64_t north);
};

}  // namespace tind
