#pragma once
// A raster that somebody asks heights for, cut into pieces with few posts under each.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/heightmaps/height_lattice.h"
#include "terrain/surface/surface.h"

namespace tind {

/// A rectangle of a raster's cells.
struct LatticePiece {
  int col = 0, row = 0, cols = 0, rows = 0;
};

/// A window of one layer, which may begin a post before the layer's first and end one behind its
/// last. Where the layer goes around the globe, columns go on beyond its last.
struct LayerPosts {
  std::size_t layer = 0;
  std::int64_t col = 0, row = 0, cols = 0, rows = 0;
  std::int64_t count() const { return cols * rows; }
};

/// Of every layer that reaches the piece, the posts that H takes there, and few more. All of the
/// layer where the piece goes around a pole or beyond what a projection knows. By the rim of the
/// piece: H is right beside the window, too, only slow.
std::vector<LayerPosts> posts_under(const Surface&, const RasterLattice&, const LatticePiece&);

struct PieceLimits {
  std::int64_t posts = 0;  // of all layers
  int cols = 0;            // of the piece
};

/// Told of a piece and of what lies under it.
using TakePiece = std::function<Result<void>(const LatticePiece&, std::span<const LayerPosts>)>;

/// Halves the piece, across the side that is longer on the ground, until all are within the limits
/// or single cells. Ends with the first error of `take`.
Result<void> cut_piece(const Surface&, const RasterLattice&, const LatticePiece&,
                       const PieceLimits&, const TakePiece& take);

}  // namespace tind
