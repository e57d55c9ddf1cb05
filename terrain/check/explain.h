#pragma once
// One tile's story: what it is made of, how wrong it is and where, and why it is as fine as it is.
// Reads the tile with the checker's decoder; so it works on anyone's tiles.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/check/check_tile.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/store/tile_store.h"
#include "terrain/surface/surface.h"

namespace tind {

/// What the posts say. Errors are the mesh's height minus the post's.
struct PostStatistics {
  static constexpr int kBins = 20;
  struct File {
    std::string name;         // of a file; of several layers the layer's
    std::uint64_t posts = 0;  // valid ones that the tile has from it
  };
  std::vector<File> files;
  std::uint64_t posts = 0, voids = 0;  // in the tile's closed rectangle
  double filled_share = 0;             // of the rectangle: there H knows no height
  double max_error_m = 0, above_m = 0, below_m = 0, mean_m = 0, rms_m = 0;
  std::array<std::uint64_t, kBins> histogram{};  // of errors from -max_error_m to max_error_m
  std::uint64_t near_budget = 0;                 // posts beyond nine tenths of the budget
  struct {
    Geographic place;
    std::int64_t col = 0, row = 0;
    double height_m = 0, error_m = 0;
  } worst;  // the first one on a tie
};

/// What became of the source's shores and breaklines in a tile: pieces of them, cut at its sides.
struct LineStory {
  std::size_t lines = 0, too_small = 0;  // those that count on the level, and those that do not
  std::size_t points = 0;                // of those that count, as they are given
  std::size_t vertices = 0;              // how many of those points are vertices of the tile
  double tolerance_m = 0;                // by which the level may thin lines, on the ground
  double farthest_m = 0;                 // of a point from the line between the vertices around it
};

struct TileExplanation {
  TileId id;
  GeoRect rect;
  std::uint64_t bytes = 0;  // unpacked
  CheckedTile mesh;
  StatedError stated;

  /// Of the level and, at the deepest one, of --max-error.
  double budget_m = 0;
  bool deepest = false;
  /// What keeps it from being coarser: "max-error" (the bound at the deepest level, or where a
  /// layer ends), "level" (what clients assume of the level), "cap" (the largest error that any
  /// tile is fitted to), "curvature" (the lattice of coarse levels), "border" (only its edges have
  /// vertices), "grid" (it is over its budget: integers cannot follow the slopes), "nothing" (two
  /// triangles).
  std::string limited_by, because;
  std::string method;  // of tind build, with its options; empty where no record says
  std::size_t border_vertices = 0, lattice_vertices = 0, free_vertices = 0;
  /// By level, the coarsest first: vertices that the tiles from that level down to this one share.
  std::vector<std::pair<int, std::size_t>> origins;

  std::optional<PostStatistics> posts;  // with a source
  std::optional<LineStory> lines;       // with a source that has lines in the tile
};

struct ExplainOptions {
  std::vector<std::string> files;  // of the source; none: only what the tile says itself
  DemOptions dem;
  std::optional<Surface> surface = {};  // what they are with their lines, or several layers
  double error_factor = 1;              // where no record of tind build lies beside the tiles
};

/// Fails when the tile cannot be had or is too damaged to be looked at. Goes over the posts of the
/// tile a few rows at a time.
Result<TileExplanation> explain_tile(const TileStore&, TileId, const ExplainOptions&,
                                     const Progress& = {});

/// H at the middles of width x height even cells of a rectangle, row 0 in the north; NaN where H
/// is void.
Result<HeightGrid> heights_over(const Surface&, const GeoRect&, int width, int height);

}  // namespace tind
