#include "tests/support/hausdorff.h"

#if TIND_WITH_CGAL
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Surface_mesh.h>
#endif

namespace tind::test {

#if TIND_WITH_CGAL

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh mesh_of(const Tin& tin) {
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertex;
  for (const Vec3& p : tin.vertices) vertex.push_back(mesh.add_vertex({p.x, p.y, p.z}));
  for (const Triangle& t : tin.triangles) mesh.add_face(vertex[t[0]], vertex[t[1]], vertex[t[2]]);
  return mesh;
}

}  // namespace

std::optional<double> bounded_hausdorff(const Tin& a, const Tin& b, double bound) {
  return CGAL::Polygon_mesh_processing::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(
      mesh_of(a), mesh_of(b), bound);
}

#else

std::optional<double> bounded_hausdorff(const Tin&, const Tin&, double) { return {}; }

#endif

}  // namespace tind::test
