#pragma once
// OGC CDB 1.x (15-113r6, Volume 1): how it divides the globe into geocells and tiles, and what the
// files of elevations are called.

#include <string>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/heightmaps/height_lattice.h"

namespace tind::cdb {

inline constexpr int kCoarsest = -10, kFinest = 23;  // levels of detail

/// A geocell is a degree high and, by its distance from the equator, 1 to 12 wide; its name is that
/// of its south-west corner. Levels up to 0 have one tile a geocell, of 2^(10 + lod) posts a side;
/// each level beyond halves the sides of tiles of 1024 posts.
struct Tile {
  int lat = 0, lon = 0;  // degrees, of the geocell's south-west corner
  int lod = 0;
  unsigned up = 0, right = 0;  // rows from the south, columns from the west, in the geocell
  friend bool operator==(const Tile&, const Tile&) = default;
};

/// Of a geocell, in degrees of longitude.
int width_deg(int lat);

GeoRect rect(const Tile&);
int posts(int lod);  // along a side

/// "Tiles/N46/W122/001_Elevation/L02/U3/N46W122_D001_S001_T001_L02_U3_R0.tif"
std::string path(const Tile&);

/// Posts are at the corners of the grid: on the tile's western and southern edge, one step short of
/// the northern and eastern one, which are the neighbours'.
RasterLattice lattice(const Tile&);

/// The first level whose posts are no farther apart than these, along the meridian.
int level_of(double spacing_m);

/// All tiles of levels down to `deepest` that overlap a rectangle, parents before their children.
std::vector<Tile> tiles(const GeoRect&, int deepest);
/// Does its inside overlap it?
bool touches(const Tile&, const GeoRect&);

}  // namespace tind::cdb
