// The border's half-edges run with the terrain on their left, and so do the constrained edges made
// of them: the triangle on the left of one is inside, that on its right outside, and what no such
// edge parts is on one side.

#include "terrain/simplify/insertion/coarse_outline.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/mesh/manifold.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
using Edge = std::array<Index, 2>;
constexpr Index kNone = HalfedgeMesh::kNone;

struct Outline {
  std::vector<Vec3> points;  // no two in one place of the plane
  std::vector<Edge> edges;   // with the terrain on their left
};

Outline outline_of(const TerrainMesh& terrain) {
  const HalfedgeMesh& m = terrain.mesh;
  Outline out;
  std::map<std::pair<double, double>, Index> place;
  const auto enter = [&](Index v) {
    const Vec3& p = m.position(v);
    const auto [at, is_new] = place.try_emplace({p.x, p.y}, Index(out.points.size()));
    if (is_new) out.points.push_back(p);
    return at->second;
  };
  for (Index h = 0; h < m.halfedge_slots(); ++h) {
    if (!m.alive_triangle(h / 3) || m.twin(h) != kNone) continue;
    if (terrain.kind[m.origin(h)] != VertexKind::fixed) continue;
    Index last = m.dest(h);  // on along a side, whose ends are fixed
    while (terrain.kind[last] != VertexKind::fixed) last = m.dest(m.out(last));
    out.edges.push_back({enter(m.origin(h)), enter(last)});
  }
  return out;
}

bool is_rectangle(const Outline& o) {
  if (o.points.size() != 4 || o.edges.size() != 4) return false;
  return std::ranges::all_of(o.edges, [&](const Edge& e) {
    return o.points[e[0]].x == o.points[e[1]].x || o.points[e[0]].y == o.points[e[1]].y;
  });
}

/// Its corners in order, from the first edge on.
Tin two_triangles(const Outline& o) {
  Tin tin;
  Edge at = o.edges[0];
  for (int k = 0; k < 4; ++k) {
    tin.vertices.push_back(o.points[at[0]]);
    at = *std::ranges::find(o.edges, at[1], [](const Edge& e) { return e[0]; });
  }
  tin.triangles = {{0, 1, 2}, {0, 2, 3}};
  return tin;
}

std::unexpected<Error> cannot(const Vec3& p, const char* why) {
  return fail(Errc::bad_data, std::string("the outline ") + why + " near x " + std::to_string(p.x) +
                                  ", y " + std::to_string(p.y) +
                                  ": a method that starts from all triangles does without it (qem, "
                                  "memoryless, edge-cost)");
}

/// Those on the terrain's side.
Result<std::vector<Triangle>> inside(const Outline& o, const std::vector<Vec3>& points,
                                     const std::vector<Triangle>& triangles) {
  enum : std::int8_t { unknown, in, out };
  std::map<Edge, std::uint32_t> left_of;  // directed edge: its triangle
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) left_of[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
  std::vector<Edge> walls = o.edges;
  std::ranges::sort(walls);
  const auto wall = [&](const Edge& e) {
    return std::ranges::binary_search(walls, e) ||
           std::ranges::binary_search(walls, Edge{e[1], e[0]});
  };
  std::vector<std::int8_t> side(triangles.size(), unknown);
  std::vector<std::uint32_t> todo;
  for (const Edge& e : walls) {
    const auto here = left_of.find(e);
    if (here == left_of.end()) return cannot(points[e[0]], "touches itself");
    if (std::exchange(side[here->second], in) == out) return cannot(points[e[0]], "touches itself");
    todo.push_back(here->second);
    const auto beyond = left_of.find({e[1], e[0]});
    if (beyond == left_of.end()) continue;
    if (std::exchange(side[beyond->second], out) == in)
      return cannot(points[e[0]], "touches itself");
    todo.push_back(beyond->second);
  }
  while (!todo.empty()) {
    const std::uint32_t t = todo.back();
    todo.pop_back();
    for (int k = 0; k < 3; ++k) {
      const Edge e = {triangles[t][k], triangles[t][(k + 1) % 3]};
      const auto next = left_of.find({e[1], e[0]});
      if (next == left_of.end() || wall(e) || side[next->second] == side[t]) continue;
      if (side[next->second] != unknown) return cannot(points[e[0]], "touches itself");
      side[next->second] = side[t];
      todo.push_back(next->second);
    }
  }
  std::vector<Triangle> kept;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (side[t] != in) continue;
    const auto& [a, b, c] = triangles[t];
    if (!surely_ccw(points[a], points[b], points[c]))
      return cannot(points[a], "leaves a triangle without room");
    kept.push_back(triangles[t]);
  }
  return kept;
}

}  // namespace

Result<Tin> coarse_outline(const TerrainMesh& terrain) {
  const Outline outline = outline_of(terrain);
  if (is_rectangle(outline)) return two_triangles(outline);
  Tin tin;
  tin.vertices = outline.points;
  const auto all = triangulate(tin.vertices, outline.edges);
  if (!all) return std::unexpected(all.error());
  if (tin.vertices.size() > outline.points.size())
    return cannot(tin.vertices.back(), "touches itself");
  auto kept = inside(outline, tin.vertices, *all);
  if (!kept) return std::unexpected(kept.error());
  tin.triangles = std::move(*kept);
  make_manifold(tin);
  drop_unused_vertices(tin);
  return tin;
}

}  // namespace tind
