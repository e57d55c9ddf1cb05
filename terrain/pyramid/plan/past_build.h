#pragma once
// What a build's record says of the surface that its tiles were made of, and of their plan: enough
// to tell which of them another surface changes, with none of its files at hand.

#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/store/build_record.h"
#include "terrain/surface/surface.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {

/// What a record keeps of the layers.
std::vector<LayerRecord> layer_records(const Surface&);

struct PastBuild {
  std::vector<LayerRecord> layers;
  Surface surface;  // knows where posts were; cannot read them
  TilePlan plan;    // without an index
  SurfaceBlocks blocks;
};

/// `blocks`: what was kept with the record. `options`: those of today, of which may_update() says
/// that they were the same. Fails with bad_data where the record does not know its layers, or the
/// blocks are not theirs.
Result<PastBuild> past_build(const BuildRecord&, std::string_view blocks, const TileSetOptions&);

}  // namespace tind
