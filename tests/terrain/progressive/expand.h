#pragma once
// Splits applied in the plainest way, straight from the definition in progressive_mesh.h: what the
// fast code is compared with. O(triangles) a split.

#include <algorithm>
#include <map>

#include "terrain/progressive/stream/progressive_mesh.h"

namespace tind::test {

inline void apply_split(Tin& mesh, const VertexSplit& s) {
  const auto added = std::uint32_t(mesh.vertices.size());
  mesh.vertices.push_back(s.added);
  mesh.vertices[s.vertex] = s.vertex_fine;
  std::map<std::uint32_t, std::size_t> fan;  // first neighbour -> triangle
  const auto corner = [&](const Triangle& t) {
    return t[0] == s.vertex ? 0 : t[1] == s.vertex ? 1 : t[2] == s.vertex ? 2 : -1;
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const int k = corner(mesh.triangles[t]); k >= 0) fan[mesh.triangles[t][(k + 1) % 3]] = t;
  for (std::uint32_t p = s.left; p != s.right && fan.contains(p);) {
    Triangle& t = mesh.triangles[fan[p]];
    const int k = corner(t);
    p = t[(k + 2) % 3];
    t[k] = added;
  }
  mesh.triangles.push_back({added, s.vertex, s.left});
  if (s.right != VertexSplit::kNone) mesh.triangles.push_back({s.vertex, added, s.right});
}

/// The mesh after the first `count` splits.
inline Tin expand(const ProgressiveMesh& pm, std::size_t count) {
  Tin mesh = pm.base;
  for (std::size_t i = 0; i < count; ++i) apply_split(mesh, pm.splits[i]);
  return mesh;
}

/// The same mesh whatever the order of triangles and where each begins.
inline std::vector<Triangle> sorted_triangles(const Tin& tin) {
  std::vector<Triangle> all = tin.triangles;
  for (Triangle& t : all) std::ranges::rotate(t, std::ranges::min_element(t));
  std::ranges::sort(all);
  return all;
}

}  // namespace tind::test
