// Does a mesh have what was asked of it? Asked of the mesh alone, whatever method made it.

#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "terrain/mesh/exact_line.h"
#include "terrain/simplify/constraints/constraints.h"

namespace tind {

namespace {

using Index = std::uint32_t;

/// Vertices by their places. Where two parts of a mesh touch in a point, each has a vertex there:
/// both are the one that comes first.
class Places {
 public:
  explicit Places(const Tin& tin) {
    one_.reserve(tin.vertices.size());
    for (Index v = 0; v < tin.vertices.size(); ++v)
      one_.push_back(at_.try_emplace({tin.vertices[v].x, tin.vertices[v].y}, v).first->second);
  }
  Index one(Index v) const { return one_[v]; }
  std::optional<Index> at(const Vec3& p) const {
    const auto found = at_.find({p.x, p.y});
    return found == at_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  std::map<std::pair<double, double>, Index> at_;
  std::vector<Index> one_;
};

/// Neighbours of each place.
struct Neighbours {
  std::vector<std::size_t> start;
  std::vector<Index> all;
  Neighbours(const Tin& tin, const Places& places) : start(tin.vertices.size() + 1, 0) {
    for (const Triangle& t : tin.triangles)
      for (const Index v : t) start[places.one(v) + 1] += 2;
    std::partial_sum(start.begin(), start.end(), start.begin());
    all.resize(start.back());
    std::vector<std::size_t> fill(start.begin(), start.end() - 1);
    for (const Triangle& t : tin.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        std::size_t& next = fill[places.one(t[k])];
        all[next++] = places.one(t[(k + 1) % 3]);
        all[next++] = places.one(t[(k + 2) % 3]);
      }
  }
};

}  // namespace

ConstraintCheck check_constraints(const Tin& tin, const Constraints& constraints) {
  ConstraintCheck check;
  const Places places(tin);
  const Neighbours near(tin, places);
  const auto holds = [&](const Vec3& a, const Vec3& b) {
    const auto from = places.at(a), to = places.at(b);
    if (!from || !to) return false;
    for (Index v = *from; v != *to;) {
      Index next = v;
      for (std::size_t k = near.start[v]; k < near.start[v + 1]; ++k) {
        const Vec3& p = tin.vertices[near.all[k]];
        const bool ahead = (p.x == b.x && p.y == b.y) || on_segment(tin.vertices[v], b, p);
        if (ahead && (next == v || near.all[k] == *to)) next = near.all[k];
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
