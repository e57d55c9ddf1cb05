#include "terrain/tile/triangle_order.h"

#include <algorithm>

#include "terrain/mesh/halfedge_mesh.h"

namespace tind {

std::vector<Triangle> coherent_order(const Tin& tin) {
  const auto mesh = HalfedgeMesh::from_tin(tin);
  if (!mesh) return tin.triangles;
  using Index = HalfedgeMesh::Index;
  std::vector<Triangle> order;
  order.reserve(tin.triangles.size());
  std::vector<std::uint8_t> done(mesh->triangle_slots(), 0);
  std::vector<Index> open;  // half-edges over which the walk can go on, newest last
  // The walk starts in the south-west corner, where the deltas' first values are small.
  Index start = 0;
  for (Index t = 0; t < mesh->triangle_slots(); ++t)
    for (const auto v : tin.triangles[t])
      if (tin.vertices[v].x == 0 && tin.vertices[v].y == 0) start = t;
  auto visit = [&](Index h) {  // into the triangle of h, which is entered over h
    const Index t = HalfedgeMesh::triangle(h);
    done[t] = 1;
    order.push_back({mesh->origin(h), mesh->dest(h), mesh->apex(h)});
    for (const Index e : {HalfedgeMesh::next(h), HalfedgeMesh::prev(h)})
      if (mesh->twin(e) != HalfedgeMesh::kNone) open.push_back(mesh->twin(e));
  };
  for (Index first = 0; first <= mesh->triangle_slots(); ++first) {
    const Index t = first == 0 ? start : first - 1;
    if (done[t]) continue;
    visit(3 * t);
    while (!open.empty()) {
      const Index h = open.back();
      open.pop_back();
      if (!done[HalfedgeMesh::triangle(h)]) visit(h);
    }
  }
  return order;
}

}  // namespace tind
