#pragma once
// Encodes a tile as GLB (binary glTF): positions around its centre, normals, error in `extras`.
//
// A client draws a triangle straight through space, so this mesh is not to the last digit the one
// that the tile's certificate is about, whose triangles are straight in longitude, latitude and
// height. What lies between the two is bounded here and part of every error that is stated.

#include <array>
#include <cstdint>
#include <vector>

#include "proto/tile/glb.h"
#include "terrain/base/enum_names.h"
#include "terrain/tile/tile_model.h"

namespace tind {

/// meshopt: EXT_meshopt_compression, a third of the bytes. Positions are then 16-bit numbers on a
/// coarser lattice and normals have 8 bits.
enum class GlbCompression { none, meshopt };

template <>
struct EnumNames<GlbCompression> {
  static constexpr const char* kWhat = "compression";
  static constexpr std::pair<GlbCompression, const char*> kAll[] = {
      {GlbCompression::none, "none"}, {GlbCompression::meshopt, "meshopt"}};
};

/// How far the mesh of a GLB is from the tile's own.
struct SpaceError {
  double moved_m = 0;    // a vertex, by the rounding of its position
  double shift_m = 0;    // any place of the surface, by rounding and by its being straight
  double surface_m = 0;  // what these make vertically: on steep ground more than the shift
  double edge_m = 0;     // of its border, vertically, over its own line
};
/// O(triangles).
SpaceError space_error(const TileModel&, GlbCompression = GlbCompression::none);

/// Positions of all tiles of a level are multiples of this many metres (ECEF), the nodes' own, too:
/// what a client adds up in double is exact, so neighbours agree to the bit on their common edge.
/// A power of two; 1 m on level 0, an eighth of a millimetre from level 13 on. Floats hold 2^24 of
/// them: enough for a tile on earth, 8976 km / 2^level above and below its middle. (One of more
/// relief would be rounded to coarser multiples: made-up heights.)
/// Compressed, 512 m / 2^level, which is a 150th of the level's nominal error: 2^16 of them are
/// enough for a tile whose heights reach 8976 km / 2^level above and below its middle. One of more
/// relief is on the same lattice, and not compressed.
double glb_lattice(int level, GlbCompression = GlbCompression::none);

/// What lies over a tile, or nothing.
struct GlbDrape {
  /// Linear red, green, blue, one a vertex. Compressed they have 16 bits.
  std::vector<std::array<float, 3>> colours = {};
  /// Kinds of ground, and which of them each triangle is, or proto::kNoGlbClass. Clients have one
  /// at vertices, and between two of them they see whatever is between their numbers: so a vertex
  /// where triangles of several meet is there once for each.
  std::vector<proto::GlbClass> classes = {};
  std::vector<std::uint16_t> covers = {};
};

/// What a GLB of 3D Tiles has beside the surface.
struct GlbTileOptions {
  bool edges = false;  // the vertices of its sides, as CesiumJS's terrain wants them
  double skirt_m = 0;  // walls that hang so deep from its border; 0: none
  bool water = false;  // the tile's water mask, where it has one
  bool matt = false;   // says what light does to it; else that is left to who draws it
  GlbCompression compression = GlbCompression::none;
  GlbDrape drape = {};
};

/// Lossless but for the rounding to the lattice. Its node's extras state `max_error_m`, which no
/// post of the tile is farther from the mesh as it is drawn.
std::vector<std::uint8_t> encode_glb(const TileModel&);
/// The same with what 3D Tiles need. The walls are a primitive of their own, marked in its extras.
std::vector<std::uint8_t> encode_glb(const TileModel&, const GlbTileOptions&);

}  // namespace tind
