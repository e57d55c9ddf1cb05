#include "terrain/simplify/collapse/placement.h"

#include <algorithm>
#include <tuple>

namespace tind {

std::vector<std::uint8_t> SurfaceRules::seams(const HalfedgeMesh& mesh) {
  const auto place = [&](Index v) {
    const Vec3& p = mesh.position(v);
    return std::tuple(p.x, p.y, p.z);
  };
  std::vector<Index> border;
  for (Index v = 0; v < mesh.vertex_slots(); ++v)
    if (mesh.alive_vertex(v) && mesh.on_border(v)) border.push_back(v);
  std::ranges::sort(border, {}, place);
  std::vector<std::uint8_t> seam(mesh.vertex_slots(), 0);
  for (std::size_t i = 1; i < border.size(); ++i)
    if (place(border[i - 1]) == place(border[i])) seam[border[i - 1]] = seam[border[i]] = 1;
  return seam;
}

bool SurfaceRules::allows(const HalfedgeMesh& mesh, Index h, const Vec3& at) const {
  return mesh.all_kept(h, [&](Index e) {
    const Vec3 &b = mesh.position(mesh.dest(e)), &c = mesh.position(mesh.apex(e));
    return allows_triangle({mesh.position(mesh.origin(e)), b, c}, {at, b, c});
  });
}

}  // namespace tind
