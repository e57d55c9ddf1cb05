#pragma once
// Encodes a tile as GLB (binary glTF): positions around its centre, normals, error in `extras`.
//
// A client draws a triangle straight through space, so this mesh is not to the last digit the one
// that the tile's certificate is about, whose triangles are straight in longitude, latitude and
// height. What lies between the two is bounded here and part of every error that is stated.

#include <cstdint>
#include <vector>

#include "terrain/tile/tile_model.h"

namespace tind {

/// How far the mesh of a GLB is from the tile's own.
struct SpaceError {
  double moved_m = 0;    // a vertex, by the rounding of its position
  double shift_m = 0;    // any place of the surface, by rounding and by its being straight
  double surface_m = 0;  // what these make vertically: on steep ground more than the shift
  double edge_m = 0;     // of its border, vertically, over its own line
};
/// O(triangles).
SpaceError space_error(const TileModel&);

/// Positions of all tiles of a level are multiples of this many metres (ECEF), the nodes' own, too:
/// what a client adds up in double is exact, so neighbours agree to the bit on their common edge.
/// A power of two; 1 m on level 0, an eighth of a millimetre from level 13 on. Floats hold 2^24 of
/// them: enough for a tile on earth, 8976 km / 2^level above and below its middle. (One of more
/// relief would be rounded to coarser multiples: made-up heights.)
double glb_lattice(int level);

/// What a GLB of 3D Tiles has beside the surface.
struct GlbTileOptions {
  bool edges = false;  // the vertices of its sides, as CesiumJS's terrain wants them
  double skirt_m = 0;  // walls that hang so deep from its border; 0: none
  bool water = false;  // the tile's water mask, where it has one
  bool matt = false;   // says what light does to it; else that is left to who draws it
};

/// Lossless but for the rounding to the lattice. Its node's extras state `max_error_m`, which no
/// post of the tile is farther from the mesh as it is drawn.
std::vector<std::uint8_t> encode_glb(const TileModel&);
/// The same with what 3D Tiles need. The walls are a primitive of their own, marked in its extras.
std::vector<std::uint8_t> encode_glb(const TileModel&, const GlbTileOptions&);

}  // namespace tind
