#include "terrain/mesh/validity.h"

#include <algorithm>
#include <vector>

namespace tind {

namespace {

void note(MeshValidity& v, std::string text) {
  if (v.first_problem.empty()) v.first_problem = std::move(text);
}

std::string text(const Triangle& t) {
  return "triangle " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " +
         std::to_string(t[2]);
}

}  // namespace

MeshValidity check_validity(const Tin& tin) {
  MeshValidity v;
  const std::size_t n = tin.vertices.size();
  std::vector<std::uint8_t> used(n, 0);
  std::vector<std::uint64_t> edges;  // from << 32 | to
  edges.reserve(3 * tin.triangles.size());
  for (const Triangle& t : tin.triangles) {
    if (t[0] >= n || t[1] >= n || t[2] >= n || t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
      ++v.bad_indices;
      note(v, text(t) + " names a vertex that is not there, or one twice");
      continue;
    }
    const double area = orient2d(tin.vertices[t[0]], tin.vertices[t[1]], tin.vertices[t[2]]);
    v.area += area / 2;
    if (!(area > 0)) {
      ++v.flipped;
      note(v, text(t) + " is clockwise or has no area seen from above");
    }
    for (int k = 0; k < 3; ++k) {
      used[t[k]] = 1;
      edges.push_back(std::uint64_t(t[k]) << 32 | t[(k + 1) % 3]);
    }
  }
  v.unused_vertices = n - std::size_t(std::count(used.begin(), used.end(), 1));
  std::sort(edges.begin(), edges.end());
  std::vector<std::uint32_t> border_out(n, 0);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && edges[i] == edges[i - 1]) {
      ++v.non_manifold;
      note(v, "edge " + std::to_string(edges[i] >> 32) + "-" +
                  std::to_string(std::uint32_t(edges[i])) + " is used twice in one direction");
    }
    const std::uint64_t back = edges[i] << 32 | edges[i] >> 32;
    if (std::binary_search(edges.begin(), edges.end(), back)) continue;
    ++v.border_edges;
    // A vertex where two borders leave joins two fans that share nothing else.
    if (++border_out[edges[i] >> 32] == 2) {
      ++v.non_manifold;
      note(v, "the triangles at vertex " + std::to_string(edges[i] >> 32) + " form two fans");
    }
  }
  return v;
}

}  // namespace tind
