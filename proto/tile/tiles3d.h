#pragma once
// 3D Tiles 1.1 (OGC 22-025r4) with implicit tiling, as tind writes it: tileset.json with the two
// hemispheres of the EPSG:4326 pyramid, and .subtree files that say which tiles there are and where
// they lie. As Cesium3DTilesTerrainProvider wants them, too.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/tile/layer_json.h"

namespace tind::proto {

/// What the metadata of a tile say of it and of all tiles below it.
struct Tile3d {
  double min_height = 0, max_height = 0;  // ellipsoidal; as floats, rounded outwards
  std::array<double, 4> sphere{};         // ECEF centre, radius
  std::array<double, 3> horizon_occlusion{};
  double geometric_error = 0;
};

/// The Morton number of a tile among 4^level: bits of x and y in turn, x the lowest.
std::uint32_t morton(std::uint32_t x, std::uint32_t y);

struct Subtree {
  /// Level by level, each by Morton numbers, (4^levels - 1) / 3 of them; y counts from the south.
  /// Nothing where there is no tile. All have content.
  std::vector<std::optional<Tile3d>> tiles;
  /// On the level below the last, 4^levels: the roots of further subtrees.
  std::vector<bool> children;
};

/// REQUIRES: one tile at least. Deterministic.
std::vector<std::uint8_t> encode(const Subtree&);

struct Tileset3d {
  std::string name, version, attribution;
  /// Of the hemispheres' tiles, as a client halves it from level to level.
  double geometric_error = 0;
  double min_height = 0, max_height = 0;
  int levels = 1;          // of the whole pyramid
  int subtree_levels = 1;  // of a subtree
  std::vector<StatedAccuracy> accuracy = {};
};

/// Its content is at {west,east}/{level}/{x}/{y}.glb, its subtrees at the same with .subtree, x
/// counting from the west of the hemisphere.
std::string encode(const Tileset3d&);

}  // namespace tind::proto
