// The overlay is coarsened by half-edge collapses until only the coarse mesh is left; read
// backwards, they are the splits. Three stages: splits that turn out not to be needed go for good;
// then everything inside, cheapest first, which is what the splits record; then the borders.
//
// A vertex inside a coarse triangle may go to any neighbour (all lie in that triangle, closed), one
// on a coarse edge along that edge only. So the coarse surface stays what it is throughout, and the
// cost is the step that the fine surface makes where the vertex was.

#include "terrain/progressive/transition/terrain_transition.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "terrain/progressive/stream/vertex_queue.h"
#include "terrain/progressive/transition/overlay.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr double kNoStep = 1e-7;  // metres of height

class Coarsener {
 public:
  struct Removed {
    Index vertex, into, left, right;
  };

  Coarsener(Overlay& o, std::stop_token stop) : o_(o), m_(o.mesh), stop_(std::move(stop)) {}

  /// Takes away every vertex that `may_go` and can, while its cost is at most `limit`.
  template <class MayGo>
  Result<void> run(MayGo&& may_go, double limit, std::vector<Removed>* log) {
    // What could not go may become free when something two rings away has gone: so, again.
    for (bool progress = true; progress;) {
      progress = false;
      for (Index v = 0; v < m_.vertex_slots(); ++v)
        if (m_.alive_vertex(v) && may_go(v)) push(v, limit);
      for (Index v = queue_.pop(); v != kNone; v = queue_.pop()) {
        if (stop_.stop_requested()) return fail(Errc::cancelled, "stopped");
        if (!m_.alive_vertex(v)) continue;
        const Choice c = best(v, limit);
        if (c.half == kNone || !m_.link_ok(c.half)) continue;
        progress = true;
        const Index into = m_.dest(c.half), twin = m_.twin(c.half);
        if (log) log->push_back({v, into, m_.apex(c.half), twin == kNone ? kNone : m_.apex(twin)});
        // Only what had a triangle with v has another star now.
        around_.clear();
        m_.for_each_neighbour(v, [&](Index n) { around_.push_back(n); });
        m_.collapse(c.half);
        for (const Index n : around_)
          if (may_go(n)) push(n, limit);
      }
    }
    return {};
  }

 private:
  struct Choice {
    Index half = kNone;
    double cost = HUGE_VAL;
  };
  struct Candidate {
    double cost;
    std::size_t to;  // in ring_
  };
  Overlay& o_;
  HalfedgeMesh& m_;
  std::stop_token stop_;
  VertexQueue queue_;
  std::vector<Index> around_;
  std::vector<Index> ring_;  // half-edges that leave a vertex
  std::vector<Candidate> candidates_;
  std::vector<std::size_t> first_;  // triangles of the ring, in the order in which they are asked

  void push(Index v, double limit) { queue_.push(v, best(v, limit).cost); }

  /// Whether the coarse mesh lets the origin of h go to its other end.
  bool along_its_line(Index h) const {
    const Index v = m_.origin(h), to = m_.dest(h), line = o_.line[v];
    if (line == Overlay::kInside) return true;
    if (line == Overlay::kSide) return m_.twin(h) == kNone;
    return o_.line[to] == line || to == o_.edge[line][0] || to == o_.edge[line][1];
  }

  /// The step of the fine surface at v's place when v goes along h; nothing when a triangle flips.
  double cost(Index h) const {
    const Index v = m_.origin(h);
    const Vec3 &p = m_.position(v), &q = m_.position(m_.dest(h));
    double best = -HUGE_VAL, step = HUGE_VAL;
    const bool valid = m_.all_kept(v, h, [&](Index e) {
      const Vec3 &pa = m_.position(m_.dest(e)), &pb = m_.position(m_.apex(e));
      if (!surely_ccw(q, pa, pb)) return false;
      const double area = orient2d(q, pa, pb);
      const double wa = orient2d(q, p, pb) / area, wb = orient2d(q, pa, p) / area;
      const double inside = std::min({wa, wb, 1 - wa - wb});
      if (inside <= best) return true;
      best = inside;
      step = std::abs(q.z + wa * (pa.z - q.z) + wb * (pb.z - q.z) - p.z);
      return true;
    });
    return valid ? step : HUGE_VAL;
  }

  /// The cheapest way for v to go, within the limit. The link condition is not asked: inside, a
  /// common neighbour beyond the two apexes would turn a triangle over.
  Choice best(Index v, double limit) {
    if (o_.line[v] == Overlay::kCorner) return {};
    if (o_.line[v] == Overlay::kInside) return best_inside(v, limit);
    Choice c;
    m_.for_each_out(v, [&](Index h) {
      if (!along_its_line(h)) return;
      const double k = cost(h);
      if (k < c.cost && k <= limit && m_.link_ok(h)) c = {h, k};
    });
    return c;
  }

  const Vec3& ring(std::size_t i) const { return m_.position(m_.dest(ring_[i % ring_.size()])); }

  /// The same with all neighbours to choose from. A shore can give a vertex hundreds of them, so
  /// the triangle in which v's place comes to lie is found for all of them in one turn, and who is
  /// too dear is not asked whether a triangle flips. O(degree log degree) typically.
  Choice best_inside(Index v, double limit) {
    ring_.clear(), candidates_.clear(), first_.clear();
    m_.for_each_out(v, [&](Index h) { ring_.push_back(h); });
    const std::size_t n = ring_.size();
    const Vec3& p = m_.position(v);
    // Triangle i is of ring i and i + 1; on the way to j, all but j - 1 and j are kept.
    for (std::size_t j = 0, i = 0; j < n && n > 2; ++j) {
      const Vec3& q = ring(j);
      for (i = std::max(i, j + 1); i < j + n - 2 && orient2d(q, p, ring(i + 1)) < 0;) ++i;
      const Vec3 &pa = ring(i), &pb = ring(i + 1);
      if (!surely_ccw(q, pa, pb)) continue;
      const double area = orient2d(q, pa, pb);
      const double wa = orient2d(q, p, pb) / area, wb = orient2d(q, pa, p) / area;
      const double step = std::abs(q.z + wa * (pa.z - q.z) + wb * (pb.z - q.z) - p.z);
      if (step <= limit) candidates_.push_back({step, j});
    }
    std::ranges::sort(candidates_, {}, [](const Candidate& c) { return std::pair(c.cost, c.to); });
    for (std::size_t i = 0; i < n; ++i) first_.push_back(i);
    for (const Candidate& c : candidates_)
      if (keeps_all(c.to)) return {ring_[c.to], c.cost};
    return {};
  }

  /// Whether no triangle flips. The one that does comes first the next time: few of them stand
  /// against most neighbours.
  bool keeps_all(std::size_t to) {
    const std::size_t n = ring_.size();
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t i = first_[k];
      if (i == to || (i + 1) % n == to || surely_ccw(ring(to), ring(i), ring(i + 1))) continue;
      std::swap(first_[k], first_[k / 2]);
      return false;
    }
    return true;
  }
};

std::string place(const Vec3& p) { return std::to_string(p.x) + ", " + std::to_string(p.y); }

/// What is left must be the coarse mesh, triangle by triangle.
Result<void> arrived(const Overlay& o, const Tin& coarse) {
  for (Index v = 0; v < o.mesh.vertex_slots(); ++v)
    if (o.mesh.alive_vertex(v) && o.line[v] != Overlay::kCorner)
      return fail(Errc::bad_data, "the meshes cannot be brought together: the vertex at " +
                                      place(o.mesh.position(v)) + " has nowhere to go");
  std::vector<Index> number(o.mesh.vertex_slots(), kNone);
  for (std::size_t j = 0; j < o.corner.size(); ++j) number[o.corner[j]] = Index(j);
  const auto turned = [](Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::vector<Triangle> want, have;
  for (const Triangle& t : coarse.triangles) want.push_back(turned(t));
  for (Index h = 0; h < o.mesh.halfedge_slots(); h += 3)
    if (o.mesh.alive_triangle(h / 3))
      have.push_back(turned(
          {number[o.mesh.origin(h)], number[o.mesh.origin(h + 1)], number[o.mesh.origin(h + 2)]}));
  std::sort(want.begin(), want.end());
  std::sort(have.begin(), have.end());
  if (want == have) return {};
  const auto [w, h] = std::mismatch(want.begin(), want.end(), have.begin(), have.end());
  const Triangle& t = w != want.end() ? *w : have.back();
  return fail(Errc::bad_data,
              "the coarse triangle at " + place(coarse.vertices[t[0]]) + " does not come about");
}

TerrainTransition in_order(const Overlay& o, const Tin& coarse,
                           const std::vector<Coarsener::Removed>& removed) {
  TerrainTransition out;
  std::vector<Index> number(o.mesh.vertex_slots(), kNone);
  const auto add = [&](Index slot) {
    const Vec3& p = o.mesh.position(slot);
    number[slot] = Index(out.vertices.size());
    out.vertices.push_back({p.x, p.y, o.coarse_z[slot], p.z});
    out.fine_vertices += slot < o.fine_vertices;
  };
  for (const Index slot : o.corner) add(slot);
  for (auto r = removed.rbegin(); r != removed.rend(); ++r) {
    add(r->vertex);
    out.splits.push_back(
        {number[r->into], number[r->left], r->right == kNone ? kNone : number[r->right]});
  }
  out.base = coarse.triangles;
  return out;
}

/// Triangles by vertex, so that a split finds its fan.
class Splitter {
 public:
  Splitter(const TerrainTransition& t) : triangles_(t.base), around_(t.vertices.size()) {
    triangles_.reserve(t.base.size() + 2 * t.splits.size());
    for (std::uint32_t i = 0; i < triangles_.size(); ++i)
      for (const std::uint32_t v : triangles_[i]) around_[v].push_back(i);
  }

  void split(const TerrainTransition::Split& s, std::uint32_t added) {
    // The fan from left on, counter-clockwise, goes over to the new vertex.
    for (std::uint32_t p = s.left; p != s.right;) {
      auto& fan = around_[s.vertex];
      const auto found = std::ranges::find_if(
          fan, [&](std::uint32_t t) { return after(triangles_[t], s.vertex) == p; });
      if (found == fan.end()) break;  // the border
      const std::uint32_t t = *found;
      fan.erase(found);
      around_[added].push_back(t);
      p = after(triangles_[t], p);
      std::ranges::replace(triangles_[t], s.vertex, added);
    }
    add({added, s.vertex, s.left});
    if (s.right != kNone) add({s.vertex, added, s.right});
  }
  std::vector<Triangle> take() { return std::move(triangles_); }

 private:
  std::vector<Triangle> triangles_;
  std::vector<std::vector<std::uint32_t>> around_;

  static std::uint32_t after(const Triangle& t, std::uint32_t v) {
    return t[0] == v ? t[1] : t[1] == v ? t[2] : t[0];
  }
  void add(const Triangle& t) {
    for (const std::uint32_t v : t) around_[v].push_back(std::uint32_t(triangles_.size()));
    triangles_.push_back(t);
  }
};

}  // namespace

Result<TerrainTransition> terrain_transition(const Tin& fine, const Tin& coarse,
                                             const std::stop_token& stop) {
  auto o = overlay(fine, coarse, stop);
  if (!o) return std::unexpected(o.error());
  Coarsener coarsener(*o, stop);
  std::vector<Coarsener::Removed> removed;
  const auto inside = [&](Index v) {
    return o->line[v] < Overlay::kSide || o->line[v] == Overlay::kInside;
  };
  const auto added = [&](Index v) { return v >= o->fine_vertices && inside(v); };
  if (auto done = coarsener.run(added, kNoStep, nullptr); !done)
    return std::unexpected(done.error());
  if (auto done = coarsener.run(inside, HUGE_VAL, &removed); !done)
    return std::unexpected(done.error());
  const std::size_t interior = removed.size();
  const auto all = [&](Index v) { return o->line[v] != Overlay::kCorner; };
  if (auto done = coarsener.run(all, HUGE_VAL, &removed); !done)
    return std::unexpected(done.error());
  if (const auto ok = arrived(*o, coarse); !ok) return std::unexpected(ok.error());
  TerrainTransition out = in_order(*o, coarse, removed);
  out.border_splits = removed.size() - interior;
  return out;
}

Tin mesh_at(const TerrainTransition& t, double s) {
  s = std::clamp(s, 0.0, 1.0);
  const std::size_t base = t.base_vertices(), inner = t.splits.size() - t.border_splits;
  const double reached = s * double(inner);
  const std::size_t begun =
      s == 0 ? 0 : t.border_splits + std::min(inner, std::size_t(std::ceil(reached)));
  Tin out;
  for (std::size_t v = 0; v < base + begun; ++v) {
    const TerrainTransition::Vertex& p = t.vertices[v];
    out.vertices.push_back({p.x, p.y, (1 - s) * p.coarse_z + s * p.fine_z});
  }
  if (begun > t.border_splits) {  // the last one is on its way
    const double way = std::min(1.0, reached - double(begun - t.border_splits - 1));
    const Vec3 from = out.vertices[t.splits[begun - 1].vertex], to = out.vertices.back();
    if (way < 1) out.vertices.back() = from * (1 - way) + to * way;
  }
  Splitter splitter(t);
  for (std::size_t i = 0; i < begun; ++i) splitter.split(t.splits[i], std::uint32_t(base + i));
  out.triangles = splitter.take();
  return out;
}

}  // namespace tind
