#pragma once
// The certificate, recomputed: every valid post of the source against every tile whose rectangle
// holds it. (Promise 1.)

#include <cstdint>
#include <map>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/check/check_files.h"
#include "terrain/surface/surface.h"

namespace tind {

/// What the posts say about one tile.
struct MeasuredTile {
  double max_error_m = 0;
  std::size_t layer = 0;
  std::int64_t col = 0, row = 0;  // the post where it is; the first one on a tie
  std::uint64_t posts = 0;        // valid posts in the closed rectangle
  std::uint64_t uncovered = 0;    // of them, those over no triangle
  double low_m = 0, high_m = 0;   // of the posts
  double above_m = 0;  // how far the mesh rises above a post at most; negative: it never does
  double below_m = 0;  // how far it falls below a post at most
  /// Of posts in polygons that are to be level, well inside: by level, how far the mesh is above
  /// it, at least and at most.
  struct Range {
    double low = 0, high = 0;
  };
  std::map<double, Range> flat = {};
};

struct MeasuredTiles {
  std::vector<std::vector<MeasuredTile>> tiles;  // by level and place in the listing
  std::vector<std::uint64_t> outside;            // by level: valid posts in no tile of it
  std::uint64_t posts = 0, nowhere = 0;          // valid ones; and those in no tile at all
  bool unread = false;                           // of a tile the disk or the server gave no bytes
};

/// Goes over the source once, block by block, in parallel; each
/// post is located in the tile of every level. Decoded tiles are cached, about 256 MB at most.
/// Tiles that cannot be decoded get no posts.
Result<MeasuredTiles> measure_against_source(const TileListing&, const Surface&, int threads,
                                             const Progress&);

}  // namespace tind
