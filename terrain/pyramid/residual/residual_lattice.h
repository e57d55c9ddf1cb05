#pragma once
// A tile's lattice over the terrain, and how far the terrain is from it: what lets a tile of
// millions of posts be fitted and certified without reading them. (design: "Certifying")

#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"
#include "terrain/simplify/common/samples.h"

namespace tind {

/// Square cells, a power of two a side, over the tile's rectangle (tile coordinates, 0..32767),
/// each cut into two triangles from its south-western to its north-eastern corner: a surface,
/// linear on each triangle. Halving the cells keeps the nodes and the cuts, so a coarser lattice is
/// linear on every triangle of a finer one, and two lattices differ most at nodes.
struct ResidualLattice {
  static constexpr double kExtent = 32767;

  int cells = 0;                // a side
  std::vector<float> heights;   // of the nodes, cells + 1 a side; rows from north to south
  std::vector<float> residual;  // of the cells: bound of |post - surface|; negative: has no post
  double min_m = 0, max_m = 0;  // of the valid posts in the tile's closed rectangle, with rims
  std::uint64_t posts = 0;

  int nodes() const { return cells + 1; }
  /// Is there anything that the surface is held against?
  bool any() const;
  /// Every `step`-th node, void where the cells around hold no post: what a mesh is fitted to.
  std::vector<float> fitted_heights(int step) const;
  /// So many nodes a side as samples in tile coordinates; `heights` must outlive them.
  static GridSamples samples(const std::vector<float>& heights, int nodes);
  double largest_residual() const;
  /// The height of the node that is nearest to a place.
  double nearest(double x, double y) const;
};

/// The surface over one square cell, corners as seen from above.
struct LatticeCell {
  double sw = 0, se = 0, nw = 0, ne = 0;
  double x = 0, y = 0, side = 1;  // south-western corner

  double at(double px, double py) const {
    const double s = (px - x) / side, t = (py - y) / side;
    return s >= t ? sw + s * (se - sw) + t * (ne - se) : sw + t * (nw - sw) + s * (ne - nw);
  }
};

/// The certificate: a bound of |mesh - post| over all posts of the tile. In each cell that holds
/// posts: the largest |mesh - surface|, exact, for it is linear between the vertices of both
/// triangulations' overlay, and the cell's residual. REQUIRES: a mesh that covers the rectangle.
/// O(mesh edges x cells crossed + nodes), little for each that is far from being the worst.
double lattice_bound(const Tin& mesh, const ResidualLattice&);

/// Is that bound at most `limit`? Where it is not, sooner known.
bool is_within(const Tin& mesh, const ResidualLattice&, double limit);

/// The heights of the nodes of cells whose own bound is above the limit, NaN of all others: where
/// the mesh has to follow the surface more closely.
std::vector<float> heights_of_cells_over(const Tin& mesh, const ResidualLattice&, double limit);

}  // namespace tind
