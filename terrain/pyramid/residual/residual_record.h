#pragma once
// What the residual index keeps of one tile, and its bytes. Four records make their parent's.

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/residual/residual_lattice.h"

namespace tind {

/// What a tile's posts are, and the nodes along its sides: what a record begins with, so that a
/// parent's facts and the edges of tiles take some kilobytes, not all of it.
struct ResidualFacts {
  /// (Of layers samples at rims are as good as posts, but are not counted.)
  bool has_posts() const { return min_m <= max_m; }
  std::uint64_t posts() const { return owned + on_east + on_north + on_corner; }

  float min_m = HUGE_VALF, max_m = -HUGE_VALF;  // with samples at rims; without posts: none
  /// Valid posts: inside or on the western or southern side; on the eastern side without its
  /// northern end; on the northern side without its eastern end; on the north-eastern corner.
  std::uint64_t owned = 0, on_east = 0, on_north = 0, on_corner = 0;
};

/// Residuals lie in pieces: piece k bounds |post - surface| over cells of 2^k x 2^k of the tile's
/// own, against the surface of every 2^k-th node: piece k is what the tile adds to the lattice of
/// its ancestor k levels up.
struct ResidualRecord : ResidualFacts {
  static constexpr int kCells = 256, kNodes = kCells + 1;
  static constexpr int kPieces = 9;  // down to one cell
  static constexpr float kEmpty = -1;
  static constexpr std::int32_t kMostSteps = 1 << 24;  // of a node's height: a float holds it

  /// Of the nodes, in steps; rows from north to south. Of a tile without a post what fills it
  /// beside others that have some. Empty: 0 everywhere.
  std::vector<std::int32_t> heights;
  std::array<std::vector<float>, kPieces> pieces;  // kEmpty: no post; rows from north to south

  std::int32_t height(int col, int row) const {
    return heights.empty() ? 0 : heights[std::size_t(row) * kNodes + std::size_t(col)];
  }
};

/// What a record begins with.
struct ResidualHead : ResidualFacts {
  using Side = std::array<std::int32_t, ResidualRecord::kNodes>;

  bool has_heights = false;  // else all nodes are 0
  Side north{}, south{};     // from west to east, in steps
  Side west{}, east{};       // from north to south
};

/// Fills piece k from piece k - 1: a child cell's bound and how far its surface is from the coarser
/// one, which is largest at a node.
void accumulate_piece(ResidualRecord&, int k, double step_m);

/// The record of a tile from its children's: [0] south-west, [1] south-east, [2] north-west, [3]
/// north-east; null for one that the source does not touch.
ResidualRecord join(const std::array<const ResidualRecord*, 4>& children, double step_m);

/// Residuals are rounded up, by 3 % at most and to no less than 1/250 of the piece's largest: what
/// is read back is a bound still, and the same on every machine. Nothing else is lost.
std::vector<std::uint8_t> encode(const ResidualRecord&);
/// Fails (bad_data) for bytes that `encode` cannot have made.
Result<ResidualRecord> decode_record(std::span<const std::uint8_t>);
/// From so many of the first bytes, or all where there are fewer; with a hash of their own.
constexpr std::size_t kMostHeadBytes = 5248;
Result<ResidualHead> decode_head(std::span<const std::uint8_t>);

/// The lattice of a tile from the records of its descendants some levels down, 2^levels a side,
/// rows from north to south; null for those that the source does not touch. Without what only the
/// tile's own record knows: the range of its heights and how many posts there are.
ResidualLattice lattice_of(std::span<const ResidualRecord* const>, double step_m);

}  // namespace tind
