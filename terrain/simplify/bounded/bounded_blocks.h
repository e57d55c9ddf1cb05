#pragma once
// `bounded` for a DEM of any size. It works on blocks from north to south and needs memory only for
// a few rows of blocks and for the result.

#include <cstdint>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/bounded/bounded_mesher.h"

namespace tind {

/// A DEM that need not fit into memory. Strips are read from north to south, each post once, by one
/// thread at a time.
struct HeightRows {
  int cols = 0, rows = 0;
  ReadStrip read;
};

/// Views the grid, which outlives it.
HeightRows rows_of(const HeightGrid&);

struct BlockOptions {
  MesherOptions mesher;   // eps, x_scale, effort; the rest is filled in
  double offset = 0;      // of the band's centre from the posts
  int threads = 1;        // does not change the result
  int block_posts = 512;  // about so many on a side of a block, at least 2
};

struct BlockResult {
  Tin tin;  // post coordinates, the whole rectangle
  std::uint64_t steps = 0, blocks = 0;
};

/// Fails when a read fails, when there is no valid height at all (bad_data), when stopped.
Result<BlockResult> mesh_in_blocks(const HeightRows&, const BlockOptions&, const Progress&);

}  // namespace tind
