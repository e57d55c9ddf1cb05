#pragma once
// Two models with borders as two closed ones: each border gets one more vertex, its cap, joined to
// all of it. Where a method keeps caps to caps and borders to borders, what it does to the closed
// ones it does to the open ones.

#include <cstddef>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/halfedge_mesh.h"

namespace tind {

struct CappedModels {
  using Index = HalfedgeMesh::Index;

  HalfedgeMesh fine, coarse;
  Index first_fine_cap = 0, first_coarse_cap = 0,
        caps = 0;  // cap i of the one is cap i of the other
  /// By coarse vertex: the fine one that stands for it; caps for caps. kNone inside.
  std::vector<Index> representative;
  std::size_t split_in = 0;  // fine border vertices added, where the coarse border has more

  bool fine_cap(Index v) const { return v - first_fine_cap < caps; }
  bool coarse_cap(Index v) const { return v - first_coarse_cap < caps; }
};

/// Borders are matched by how near they are, and their vertices so that the squares of the
/// distances sum up to the least that keeps their order around the border. Fails (invalid_argument)
/// where the two have not as many borders, with the place of one that is alone.
Result<CappedModels> cap_borders(HalfedgeMesh fine, HalfedgeMesh coarse);

}  // namespace tind
