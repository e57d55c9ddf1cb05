// Where triangles are counter-clockwise, the number of them above a place changes only across
// border edges: by one, and towards the triangle of the edge it grows. So where two triangles
// overlap anywhere, one that has a border edge overlaps another, and only those are asked. Whatever
// touches is no overlap: only what does so for certain, whatever rounding did, is one.

#include "terrain/mesh/terrain_tin.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/manifold.h"
#include "terrain/mesh/triangle_tree.h"

namespace tind {

namespace {

std::string place_of(const Tin& tin, const Triangle& t) {
  const Vec3 m = (tin.vertices[t[0]] + tin.vertices[t[1]] + tin.vertices[t[2]]) * (1.0 / 3);
  char text[80];
  std::snprintf(text, sizeof text, "near x %.10g, y %.10g", m.x, m.y);
  return text;
}

std::unexpected<Error> overlapping(const Tin& tin, const Triangle& t) {
  return fail(Errc::bad_data, "triangles lie above one another " + place_of(tin, t) +
                                  ": terrain has one height at a place");
}

/// For certain by any of the three corners that the test may start from: of a sliver that is seldom
/// by all.
bool certainly_ccw(const Vec3& a, const Vec3& b, const Vec3& c) {
  return surely_ccw(a, b, c) || surely_ccw(b, c, a) || surely_ccw(c, a, b);
}

/// Every triangle seen from above, or the line that says which one cannot be.
Result<void> turn_up(Tin& tin) {
  std::erase_if(tin.triangles, [](const Triangle& t) {  // nothing is left of those that weld made
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
  });
  for (Triangle& t : tin.triangles) {
    const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
    if (certainly_ccw(a, b, c)) continue;
    if (!certainly_ccw(a, c, b))
      return fail(Errc::bad_data, "a triangle " + place_of(tin, t) +
                                      " has no area seen from above: terrain has no vertical face");
    std::swap(t[1], t[2]);
  }
  return {};
}

/// True when the two have common area for certain. Both counter-clockwise.
bool overlap(const Tin& tin, const Triangle& s, const Triangle& t) {
  const auto beyond_an_edge = [&](const Triangle& of, const Triangle& other) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = tin.vertices[of[k]], &b = tin.vertices[of[(k + 1) % 3]];
      if (std::ranges::none_of(other,
                               [&](std::uint32_t v) { return surely_ccw(a, b, tin.vertices[v]); }))
        return true;
    }
    return false;
  };
  return !beyond_an_edge(s, t) && !beyond_an_edge(t, s);
}

/// A triangle that has others above or below it, if there is one.
std::uint32_t first_overlapping(const Tin& tin, const HalfedgeMesh& mesh) {
  const TriangleTree tree(tin);
  for (std::uint32_t t = 0; t < tin.triangles.size(); ++t) {
    bool border = false;
    for (HalfedgeMesh::Index h = 3 * t; h < 3 * t + 3; ++h)
      border |= mesh.twin(h) == HalfedgeMesh::kNone;
    if (border && !tree.each_near(box_of(tin, tin.triangles[t]), [&](std::uint32_t other) {
          return other == t || !overlap(tin, tin.triangles[t], tin.triangles[other]);
        }))
      return t;
  }
  return HalfedgeMesh::kNone;
}

/// Which triangle of `before` is the first that `after`, in the same order, does not have.
std::size_t first_dropped(const Tin& before, const Tin& after) {
  const auto same = [&](const Triangle& s, const Triangle& t) {
    for (int k = 0; k < 3; ++k)
      if (before.vertices[s[k]] != after.vertices[t[k]]) return false;
    return true;
  };
  std::size_t i = 0;
  while (i < after.triangles.size() && same(before.triangles[i], after.triangles[i])) ++i;
  return i;
}

}  // namespace

Result<Tin> as_terrain(Tin tin) {
  drop_attributes(tin);
  weld(tin);
  if (const auto ok = turn_up(tin); !ok) return std::unexpected(ok.error());
  drop_unused_vertices(tin);
  if (tin.triangles.empty()) return fail(Errc::bad_data, "the mesh has no triangle");
  const Tin before = tin;
  if (make_manifold(tin).dropped_triangles > 0)
    return overlapping(before, before.triangles[first_dropped(before, tin)]);
  const Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(tin);
  if (!mesh) return std::unexpected(mesh.error());
  if (const auto t = first_overlapping(tin, *mesh); t != HalfedgeMesh::kNone)
    return overlapping(tin, tin.triangles[t]);
  return tin;
}

}  // namespace tind
