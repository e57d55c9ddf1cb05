#include "terrain/simplify/collapse/placement.h"

namespace tind {

bool SurfaceRules::allows(const HalfedgeMesh& mesh, Index h, const Vec3& at) const {
  const Index g = mesh.twin(h);
  bool ok = true;
  const auto check_fan = [&](Index v) {
    mesh.for_each_out(v, [&](Index e) {
      const Index t = HalfedgeMesh::triangle(e);
      if (!ok || t == HalfedgeMesh::triangle(h)) return;
      if (g != HalfedgeMesh::kNone && t == HalfedgeMesh::triangle(g)) return;
      const Vec3 &b = mesh.position(mesh.dest(e)), &c = mesh.position(mesh.apex(e));
      ok = allows_triangle({mesh.position(v), b, c}, {at, b, c});
    });
  };
  check_fan(mesh.origin(h));
  if (ok) check_fan(mesh.dest(h));
  return ok;
}

}  // namespace tind
