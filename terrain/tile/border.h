#pragma once
// The line that two neighbouring tiles share. It is the reason why tiles have no cracks.
//
// A border is a function of edge, level and surface alone. So both tiles derive the same vertices,
// at the same integer positions, with heights on the same power-of-two step, and a client decodes
// the same bits from both. Simplifying the interior of a tile never changes its border.

#include <cmath>
#include <vector>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/surface.h"

namespace tind {

/// One side of a tile, as a line of constant longitude or latitude.
struct TileEdge {
  Geographic start, end;  // west to east, or south to north: never by which tile asks
};

/// A vertex of a border: t = 0..32767 along the edge.
struct BorderVertex {
  int t = 0;
  double height = 0;
};

enum class TileSide { west, south, east, north };
TileEdge tile_edge(TileId, TileSide);

/// Where a line crosses an edge (tile_lines.h), and the height there: the level of a shore; NaN: H.
struct BorderSample {
  double t = 0, height = 0;
};

struct BorderOptions {
  double tolerance_m = 1;  // of the line against H + offset, at H's own samples
  double offset_m = 0;     // how far above H the line should lie (tiles with --side)
  double height_step = 0;  // heights are multiples of this
  double step_at_start = 0, step_at_end = 0;  // those of the ends of these; 0: of the same
  int place_step = 1;   // t is a multiple of this, except ends, fixed vertices, narrow gaps
  int fixed_cells = 1;  // vertices at every 1 / fixed_cells of the edge stay (earth curvature)
  int samples = 64;     // of H, where the surface's posts do not give them (power of two)
  double lowest_m = -HUGE_VAL, highest_m = HUGE_VAL;  // heights beyond these are cut off
  bool halves = false;              // there is a next level: its two edges' samples count here, too
  int samples_of_half[2] = {0, 0};  // as `samples`, of those edges; 0: the same
  /// Lines that cross the edge, by t; and those of the next level its two halves.
  std::vector<BorderSample> crossings, crossings_of_half[2];
  /// A vertex that lines need: that of the crossing at `crossing`. Not at the ends of the edge.
  struct LineVertex {
    double crossing = 0;
    int t = 0;
    double height = 0;  // a breakline's own, which counts within the tolerance; NaN: as crossings
  };
  std::vector<LineVertex> lines;
};

struct Border {
  std::vector<BorderVertex> line;  // both ends included
  /// The largest distance of the line from H (with its voids filled), wherever this level or the
  /// next samples H. So the gap between the lines of two successive levels is nowhere more than the
  /// sum of their errors: both are measured at the samples of the finer level.
  double error_m = 0;
};

/// H at the places of an edge, and linear between them: what one level knows of H.
struct EdgeProfile {
  std::vector<double> at, h;  // places 0..32767, ascending, both ends among them; heights
  bool whole = false;         // H itself: every place where it bends is there

  double height(double t) const;
};

/// Of an edge whose halves are two edges of the next level, from theirs.
EdgeProfile joined(const EdgeProfile& first, const EdgeProfile& second);
/// What the next level knows of the edge, from the two edges that it has there, asked as it asks.
EdgeProfile halves_of(const TileEdge&, const HeightField&, const Surface&, const BorderOptions&);

/// The simplified line. A one-pass cone filter: from each vertex the line goes on as long as one
/// slope keeps within the tolerance of every sample; vertex heights float inside the band.
/// O(samples). In voids it follows HeightField::filled.
Border make_border(const TileEdge&, const HeightField&, const Surface&, const BorderOptions&);
/// The same from what is known of the edge; `halves`: what the next level knows, where that is
/// more. REQUIRES: a profile with all fixed places and crossings of the options.
Border make_border(const EdgeProfile&, const EdgeProfile* halves, const BorderOptions&);

}  // namespace tind
