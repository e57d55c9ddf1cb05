#pragma once
// A tile as 3D Tiles have it: its GLB with walls against gaps, and what a subtree says of it. Both
// are functions of finished tiles alone, so they are the same on demand and in batch.

#include <array>
#include <cstdint>
#include <vector>

#include "proto/tile/tiles3d.h"
#include "terrain/encode/glb_tile.h"
#include "terrain/tile/tile_model.h"

namespace tind::tiles3d {

/// How deep its walls hang: as deep as the largest step between its border and that of a tile of
/// the next coarser or of a finer level. Both borders lie within their stated errors of the same
/// line, so that is the sum of two: its own, and the larger of the parent's (null: level 0) and of
/// what any border of the next level may have. Of another maker's tile without a stated error five
/// times the level's, as CesiumJS has it.
double wall_depth_m(const TileModel&, const TileModel* parent, GlbCompression);

/// Its first primitive is the surface with CESIUM_tile_edges and without walls, which is all that
/// CesiumJS's terrain draws; the second one is the walls, for everybody else.
std::vector<std::uint8_t> content(const TileModel&, const TileModel* parent, GlbCompression,
                                  GlbDrape = {});

/// What is said of a tile without a look at those below it. `leaf`: there are none. GUARANTEES, of
/// tiles that keep their level's error: heights, sphere and occlusion point hold for all below it,
/// too (their surfaces lie within their errors of the same posts), but not over voids, which each
/// level fills by itself: there tileset.cpp grows them around all of a subtree. The geometric error
/// is how far the tile is from its posts; where it is no leaf at least what the next level may
/// have, so that it never grows on the way down. `higher`: what is below it may rise so much
/// higher, in metres.
proto::Tile3d facts(const TileModel&, const TileModel* parent, bool leaf, GlbCompression,
                    double higher = 0);

}  // namespace tind::tiles3d
