#pragma once
// The two ways in which tiles are cut here, as OGC's Two Dimensional Tile Matrix Set has them
// (17-083r4, annex D): rows are counted from the north in both.

#include <cstdint>
#include <string>

#include "server/api/ogc/document.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind::api::ogc {

struct TileMatrixSet {
  const char* id;
  const char* title;
  const char* crs;
  int first_columns;  // of level 0, which has one row
  double cell_size;   // of level 0 with 256 cells a tile, in units of the CRS
  double metres;      // per unit
  double origin[2];   // of all levels: west and north
  int max_level;

  std::string uri() const;
};

extern const TileMatrixSet kWorldCrs84Quad, kWebMercatorQuad;

/// One of the two; null: another.
const TileMatrixSet* tile_matrix_set(std::string_view id);

/// The rows of tind's own tiles are counted from the south: the one number for the other.
inline std::uint32_t flipped_row(int level, std::uint32_t row) {
  return tiling::rows(level) - 1 - row;
}

}  // namespace tind::api::ogc
