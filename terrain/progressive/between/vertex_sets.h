#pragma once
// [Yoon], section 3.1: the vertices of a fine model in sets, one for each vertex of a coarse
// model, that touch exactly where the coarse model has edges.
//
// The paper grows sets first and mends them one adjacency at a time, which can fail. Here each
// coarse edge is first given a path between its two representatives: along fine edges, cheapest
// inside the two sets that it joins and expensive elsewhere, never across another path, leaving and
// arriving between the same neighbours as the edge does in the coarse model. The paths cut the fine
// model into one patch for each coarse triangle. A path belongs half to either end, and sets grow
// on inside the patches, where only the three sets of its corners can meet.
//
// Where paths leave no vertex free to pass between, an edge with both ends taken is split (the
// paper's "limited vertex split first"). A spanning tree of the coarse edges is routed first: trees
// never part the rest of a surface, and on a sphere what the others part is what they must.
//
// Models with borders come closed by caps (border_caps.h). A cap is a set of its own, and the paths
// of border edges are the border itself; these are laid before the tree.

#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/progressive/between/border_caps.h"

namespace tind {

struct VertexSets {
  std::vector<HalfedgeMesh::Index> representative;  // by coarse vertex
  std::vector<HalfedgeMesh::Index> set;             // by fine vertex slot: the coarse vertex
  std::size_t split_in = 0;
};

/// `models.fine` gains vertices where splits are needed. REQUIRES: what cap_borders gave, of models
/// without unused vertices, at least as many fine as coarse ones.
Result<VertexSets> vertex_sets(CappedModels& models, const Progress& progress = {});

}  // namespace tind
