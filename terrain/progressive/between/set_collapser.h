#pragma once
// [Yoon], sections 3.2 and 3.3: the collapses inside vertex sets, and where the vertices go.

#include <optional>
#include <span>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/progressive/between/vertex_sets.h"
#include "terrain/progressive/stream/progressive_mesh.h"
#include "terrain/progressive/stream/space_lattice.h"

namespace tind {

/// How one set collapses. The paper's way is the default.
struct SetPlan {
  double pace = 1;  // the share t of the set gone, its vertices have gone t^pace of their way
  bool shortest_first = false;  // by length instead of by quadric
};

/// What the open models' progressive mesh is made of.
struct CollapsedSets {
  /// Numbered as the coarse model; its base is the coarse one where `left_over` is none.
  ProgressiveMesh mesh;
  std::optional<Vec3> left_over;  // where a vertex is that no collapse inside its set takes away
  std::vector<HalfedgeMesh::Index> turned;  // sets in which no collapse was left but one that turns
};                                          // a triangle over

/// Collapses all that the sets allow; one plan for each. With a lattice all places on the way lie
/// on it. O(n log n).
CollapsedSets collapse_sets(CappedModels models, const VertexSets& sets,
                            std::span<const SetPlan> plans, const SpaceLattice* lattice,
                            const Progress& progress = {});

}  // namespace tind
