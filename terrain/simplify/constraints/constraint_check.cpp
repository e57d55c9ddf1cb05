// Does a mesh have what was asked of it? Asked of the mesh alone, whatever method made it.

#include <cmath>
#include <map>
#include <numeric>

#include "terrain/mesh/exact_line.h"
#include "terrain/simplify/constraints/constraints.h"

namespace tind {

namespace {

using Index = std::uint32_t;

/// Neighbours of each vertex.
struct Neighbours {
  std::vector<std::size_t> start;
  std::vector<Index> all;
  explicit Neighbours(const Tin& tin) : start(tin.vertices.size() + 1, 0) {
    for (const Triangle& t : tin.triangles)
      for (const Index v : t) start[v + 1] += 2;
    std::partial_sum(start.begin(), start.end(), start.begin());
    all.resize(start.back());
    std::vector<std::size_t> fill(start.begin(), start.end() - 1);
    for (const Triangle& t : tin.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        all[fill[t[k]]++] = t[(k + 1) % 3];
        all[fill[t[k]]++] = t[(k + 2) % 3];
      }
  }
};

}  // namespace

ConstraintCheck check_constraints(const Tin& tin, const Constraints& constraints) {
  ConstraintCheck check;
  std::map<std::pair<double, double>, Index> at;
  for (Index v = 0; v < tin.vertices.size(); ++v) at[{tin.vertices[v].x, tin.vertices[v].y}] = v;
  const Neighbours near(tin);
  const auto holds = [&](const Vec3& a, const Vec3& b) {
    const auto from = at.find({a.x, a.y}), to = at.find({b.x, b.y});
    if (from == at.end() || to == at.end()) return false;
    for (Index v = from->second; v != to->second;) {
      Index next = v;
      for (std::size_t k = near.start[v]; k < near.start[v + 1]; ++k) {
        const Vec3& p = tin.vertices[near.all[k]];
        const bool ahead = (p.x == b.x && p.y == b.y) || on_segment(tin.vertices[v], b, p);
        if (ahead && (next == v || near.all[k] == to->second)) next = near.all[k];
      }
      if (next == v) return false;
      v = next;
    }
    return true;
  };
  for (const LinePart& part : constraints.parts) {
    ++check.parts;
    check.missing += !holds(constraints.mesh.vertices[part.a], constraints.mesh.vertices[part.b]);
  }
  if (constraints.flat.size() == 0) return check;
  for (const Triangle& t : tin.triangles) {
    const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
    const Vec3 m = (a + b + c) * (1.0 / 3);
    const Index in = constraints.flat.holding(m.x, m.y);
    if (in == PolygonSet::kNone) continue;
    const double l = constraints.level[in];
    check.not_level += a.z != l || b.z != l || c.z != l;
  }
  return check;
}

void set_level(Tin& tin, const Constraints& constraints) {
  if (constraints.flat.size() == 0) return;
  for (Vec3& v : tin.vertices) {
    const Index in = constraints.flat.holding(v.x, v.y);
    if (in != PolygonSet::kNone && std::abs(v.z - constraints.level[in]) < 1e-6)
      v.z = constraints.level[in];
  }
}

}  // namespace tind
