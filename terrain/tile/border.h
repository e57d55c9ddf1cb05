#pragma once
// The line that two neighbouring tiles share. (Promise 2: no cracks.)
//
// A border is a function of (edge, level, source) alone: both tiles derive the same vertices, at
// the same integer places with heights on the same power-of-two step, so what a client decodes is
// the same to the last bit. The interior of a tile never touches its border.

#include <vector>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/raster/dem_source.h"
#include "terrain/tile/height_field.h"

namespace tind {

/// One side of a tile, as a line of constant longitude or latitude.
struct TileEdge {
  Geographic start, end;  // west to east, or south to north: never by which tile asks
};

enum class Side { west, south, east, north };
TileEdge tile_edge(TileId, Side);

struct BorderOptions {
  double tolerance_m = 1;  // of the line against H + offset, at H's own samples
  double offset_m = 0;     // one-sided tiles: how far above H the line is meant to lie
  double height_step = 0;  // heights are multiples of this
  int place_step = 1;      // t is a multiple of this, but for ends, fixed places and want of room
  int fixed_cells = 1;     // vertices at every 1 / fixed_cells of the edge stay (earth curvature)
  int samples = 64;        // at which H is asked when the source's posts do not say (power of two)
  bool halves = false;     // there is a next level: its two edges' samples count here, too
};

/// A vertex of a border: t = 0..32767 along the edge.
struct BorderVertex {
  int t = 0;
  double height = 0;
};

struct Border {
  std::vector<BorderVertex> line;  // both ends included
  /// The largest distance of the line from H (with its voids filled), wherever this level or the
  /// next looks at H. So the gap between the lines of two successive levels is at most the sum of
  /// their errors, all along: each is measured against what the finer of them looks at.
  double error_m = 0;
};

/// The simplified line. A one-pass cone filter: from each vertex the line goes on as long as one
/// slope keeps within the tolerance of every sample; vertex heights float inside the band.
/// O(samples). In voids it follows HeightField::filled.
Border make_border(const TileEdge&, const HeightField&, const DemSource&, const BorderOptions&);

}  // namespace tind
