#include "terrain/simplify/common/collapse_recorder.h"

#include "terrain/mesh/halfedge_mesh.h"

namespace tind {

Collapse collapse_of(const HalfedgeMesh& m, std::uint32_t h, const Vec3& at) {
  const auto a = m.origin(h), b = m.dest(h), g = m.twin(h);
  return {h,
          a,
          b,
          m.apex(h),
          g == HalfedgeMesh::kNone ? HalfedgeMesh::kNone : m.apex(g),
          m.position(a),
          m.position(b),
          at};
}

}  // namespace tind
