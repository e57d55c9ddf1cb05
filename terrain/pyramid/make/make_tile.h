#pragma once
// THE path from a source to a tile: the daemon and the batch both come through here, so a tile has
// the same bytes whoever asks, whenever, on however many threads. (Promise 3.)

#include <memory>
#include <stop_token>

#include "terrain/base/result.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/store/tile_set.h"
#include "terrain/surface/surface.h"
#include "terrain/tile/tile_model.h"

namespace tind {

/// Reads heights -> borders -> bounded mesh -> referee over every post -> normals. Pure: depends on
/// the surface's content, the plan and the id alone. Thread-safe. GUARANTEES:
/// max_error_m bounds every valid post in the tile's closed rectangle against the mesh as a client
/// decodes it; it stays within the level's budget unless the source asks for more than the format's
/// integer grid can give, and says so honestly then. Where the plan has an index, tiles of its
/// levels rest on it: their error is a bound, unless that breaks the budget; then every post is
/// read after all. `cost`: what it took, where somebody wants to know.
Result<TileModel> model_tile(const Surface&, const TilePlan&, TileId, std::stop_token = {},
                             TileCost* cost = nullptr);

/// The same as quantized-mesh: what stores hold and other encodings are made of.
Result<TileBytes> make_tile(const Surface&, const TilePlan&, TileId, std::stop_token = {});

}  // namespace tind
