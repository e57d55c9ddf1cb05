#include "terrain/simplify/collapse/colour_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "terrain/simplify/common/star_fit.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

constexpr int kRounds = 4;  // more of them gain little

/// Less, by more than rounding.
bool better(double now, double before) { return now < before * (1 - 1e-6) - 1e-9; }

/// Replaces the diagonal h where the other one shows less wrongly.
bool flip(HeldMesh& held, Index h) {
  HalfedgeMesh& m = held.terrain.mesh;
  const Index a = m.origin(h), b = m.dest(h), c = m.apex(h), d = m.apex(m.twin(h));
  if (!held.interior(a) && !held.interior(b)) return false;  // as of a border, or a line
  const Vec3 &pa = m.position(a), &pb = m.position(b), &pc = m.position(c), &pd = m.position(d);
  if (!surely_ccw(pa, pd, pc) || !surely_ccw(pd, pb, pc)) return false;
  if (m.find_edge(c, d) != kNone) return false;
  const HeldColours& colours = *held.colours;
  const double before = colours.error(pa, pb, pc) + colours.error(pb, pa, pd);
  if (!better(colours.error(pa, pd, pc) + colours.error(pd, pb, pc), before)) return false;
  const WithinHeld filter(held);
  if (!filter.holds(pa, pd, pc) || !filter.holds(pd, pb, pc)) return false;
  m.flip(h);
  return true;
}

bool flip_edges(HeldMesh& held) {
  const HalfedgeMesh& m = held.terrain.mesh;
  bool any = false;
  for (Index h = 0; h < m.halfedge_slots(); ++h)
    if (m.alive_triangle(h / 3) && m.twin(h) != kNone && h < m.twin(h)) any = flip(held, h) || any;
  return any;
}

/// A vertex inside the mesh and what lies around it.
class Star {
 public:
  Star(const HeldMesh& held, Index v) : held_(held), at_(held.terrain.mesh.position(v)) {
    const HalfedgeMesh& m = held.terrain.mesh;
    m.for_each_out(v, [&](Index e) { ring_.push_back(m.position(m.dest(e))); });
    error_ = error(at_);
  }

  const Vec3& at() const { return at_; }
  double error() const { return error_; }
  double reach() const {
    double reach = 0;
    for (const Vec3& p : ring_)
      reach = std::max({reach, std::abs(p.x - at_.x), std::abs(p.y - at_.y)});
    return reach;
  }

  /// Moves to the best of eight places `step` away, where one is better and may be.
  bool move(double step) {
    const Vec3 from = at_;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (dx != 0 || dy != 0) try_at({from.x + dx * step, from.y + dy * step, from.z});
    return at_.x != from.x || at_.y != from.y;
  }

 private:
  const HeldMesh& held_;
  Vec3 at_;
  std::vector<Vec3> ring_;
  double error_ = 0;

  template <class F>
  bool all(F&& f) const {
    for (std::size_t i = 0; i < ring_.size(); ++i)
      if (!f(ring_[i], ring_[(i + 1) % ring_.size()])) return false;
    return true;
  }

  double error(const Vec3& p) const {
    double sum = 0;
    all([&](const Vec3& a, const Vec3& b) {
      sum += held_.colours->error(p, a, b);
      return true;
    });
    return sum;
  }

  void try_at(Vec3 p) {
    p = held_.snap(p);
    const auto ccw = [&](const Vec3& a, const Vec3& b) { return surely_ccw(p, a, b); };
    if (!all(ccw)) return;
    const double now = error(p);
    if (!better(now, error_)) return;
    if (held_.fit) {
      StarFit fit;
      all([&](const Vec3& a, const Vec3& b) {
        held_.fit(fit, p, a, b);
        return true;
      });
      p.z += fit.rise();
      p = held_.snap(p);
    }
    const WithinHeld filter(held_);
    if (!all([&](const Vec3& a, const Vec3& b) { return filter.holds(p, a, b); })) return;
    at_ = p;
    error_ = now;
  }
};

bool move_vertices(HeldMesh& held) {
  HalfedgeMesh& m = held.terrain.mesh;
  const double least = held.colours->step() / 2;
  bool any = false;
  for (Index v = 0; v < m.vertex_slots(); ++v) {
    if (!m.alive_vertex(v) || !held.interior(v) || m.on_border(v)) continue;
    Star star(held, v);
    if (!better(0, star.error())) continue;
    bool moved = false;
    for (double step = star.reach() / 2; step >= least; step /= 2) moved = star.move(step) || moved;
    if (moved) m.position(v) = star.at();
    any = any || moved;
  }
  return any;
}

}  // namespace

void fit_to_colours(HeldMesh& held, const Progress& progress) {
  if (!held.colours) return;
  for (int round = 0; round < kRounds && !progress.stop.stop_requested(); ++round) {
    const bool flipped = flip_edges(held);
    if (!move_vertices(held) && !flipped) return;
  }
}

}  // namespace tind
