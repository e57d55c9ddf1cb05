#pragma once
// What tells the tiles of one content, program and set of options from those of another.

#include <string>

#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/surface/surface.h"

namespace tind {

/// To be raised with every change of the bytes that are made of the same posts and options: tiles
/// of two epochs are never mixed in a folder, and clients do not take old ones from their caches.
/// A test holds it against the bytes (TileEpoch).
inline constexpr int kTileEpoch = 10;

/// As kTileEpoch, but of tiles of several layers, or files, only: those of one DEM of one file need
/// not be made again. Where heights of layers change, kLayersVersion of their residual index
/// (residual_index.cpp) is to be raised, too.
inline constexpr int kLayerEpoch = 5;
/// That where the surface is of several; 0 else.
int layer_epoch(const Surface&);

/// 32 digits for where the posts are and what their heights mean.
std::string grid_digest(const Surface&);

/// 32 digits for which tiles there are, where they are not a rectangle on every level;
/// else nothing.
std::string area_digest(const TilePlan&);

/// layer.json's `version`: EPOCH.0.NUMBER. `content` stands for the heights.
std::string tile_version(const Surface&, const TilePlan&, const std::string& content);

}  // namespace tind
