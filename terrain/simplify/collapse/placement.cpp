#include "terrain/simplify/collapse/placement.h"

namespace tind {

bool SurfaceRules::allows(const HalfedgeMesh& mesh, Index h, const Vec3& at) const {
  return mesh.all_kept(h, [&](Index e) {
    const Vec3 &b = mesh.position(mesh.dest(e)), &c = mesh.position(mesh.apex(e));
    return allows_triangle({mesh.position(mesh.origin(e)), b, c}, {at, b, c});
  });
}

}  // namespace tind
