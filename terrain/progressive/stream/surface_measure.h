#pragma once
// What a split recorder records of a surface in space: displacement.h.

#include <optional>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/progressive/stream/displacement.h"
#include "terrain/simplify/common/collapse_recorder.h"

namespace tind {

class SurfaceMeasure {
 public:
  bool other_way(const HalfedgeMesh& m, const Collapse& c) const {
    return c.kept_after == c.removed_position && c.kept_after != c.kept_before &&
           !m.on_border(c.kept);
  }

  double fine(const HalfedgeMesh& m) {
    carried_.emplace(std::vector<Vec3>(m.positions().begin(), m.positions().end()));
    return 0;
  }
  double after(const HalfedgeMesh&, const Collapse& c) {
    carried_->merge(c.removed, c.kept, c.kept_after);
    return carried_->bound();
  }

  const Displacement& carried() const { return *carried_; }

 private:
  std::optional<Displacement> carried_;
};

}  // namespace tind
