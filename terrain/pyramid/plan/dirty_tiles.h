#pragma once
// Which tiles an update has to make again.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/geo/tile_order.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/store/build_record.h"
#include "terrain/surface/surface.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {

/// What tiles are made of, before the update or after it.
struct MadeOf {
  std::span<const LayerRecord> layers;
  const Surface& surface;
  const TilePlan& plan;  // without an index
  const SurfaceBlocks& blocks;
};

struct DirtyTiles {
  std::vector<std::uint8_t> flags;  // one for each of the ids
  std::string everything;           // why all of them are, where that is so; else nothing
  // Of `after`. Every tile that they reach, now or before, is dirty.
  std::vector<std::size_t> new_layers;   // not in `before`, or there with another grid or corner
  std::vector<std::size_t> bent_layers;  // in both, but with another blend
  std::size_t gone_layers = 0;           // of `before`
};

/// Which of `ids`, tiles of `after`, would have other bytes than before, or none? A tile depends on
/// the posts of its rectangle and a few around (neighbours share lines; normals reach farther),
/// and, where there are voids among them or the source ends, on all that could fill those; on what
/// layers bend; on what its plan says of it, its neighbours and its children. An ancestor depends
/// on what its descendants do. May say yes too often, never no.
///
/// Layers are held against those with which they share the corner of their grid, in the same order.
DirtyTiles dirty_tiles(const MadeOf& before, const MadeOf& after, const TileOrder& ids);

/// How far from a tile what layers bend can lie, metres: a chain of them, each bent to the next,
/// with the cells between posts that it looks at. 0 of one DEM.
double bent_m(const Surface&);

}  // namespace tind
