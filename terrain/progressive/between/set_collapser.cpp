// Cheapest first, by the quadrics of the fine model. The vertex that stays goes on towards its
// place in the coarse model by as much as its set has lost; where a triangle would turn over on
// that way, another place is tried, and where all turn one, the collapse waits for the others.

#include "terrain/progressive/between/set_collapser.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "terrain/progressive/stream/split_recorder.h"
#include "terrain/progressive/stream/surface_measure.h"
#include "terrain/progressive/stream/vertex_queue.h"
#include "terrain/simplify/collapse/quadric_n.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr double kTurned = 1e30;  // added to the cost of a collapse that turns a triangle over
constexpr double kCosine = 1e-3;  // of the largest angle that is no turn: keeps clear of 90 degrees

/// Borders are where the caps are.
bool on_border(const CappedModels& models, Index v) {
  bool found = false;
  models.fine.for_each_out(v,
                           [&](Index h) { found = found || models.fine_cap(models.fine.dest(h)); });
  return found;
}

struct CappedMeasure : SurfaceMeasure {
  const CappedModels& models;

  explicit CappedMeasure(const CappedModels& m) : models(m) {}
  bool other_way(const HalfedgeMesh& m, const Collapse& c) const {
    return SurfaceMeasure::other_way(m, c) && !on_border(models, c.kept);
  }
};

class SetCollapser {
 public:
  SetCollapser(CappedModels& models, const VertexSets& sets, std::span<const SetPlan> plans,
               const SpaceLattice* lattice)
      : models_(models),
        m_(models.fine),
        sets_(sets),
        plans_(plans),
        lattice_(lattice),
        measure_(models),
        recorder_(measure_, {}, 1) {
    recorder_.fine(m_);
    quadric_.resize(m_.vertex_slots());
    entered_.assign(m_.vertex_slots(), HUGE_VAL);
    size_.assign(models.coarse.vertex_slots(), 0);
    for (Index v = 0; v < m_.vertex_slots(); ++v) ++size_[sets.set[v]];
    for (Index h = 0; h < m_.halfedge_slots(); h += 3) add_triangle(h);
  }

  CollapsedSets run(const Progress& report) {
    // What could not go may be free when something two rings away has gone: so, again.
    std::size_t gone = 0;
    for (bool progress = true; progress && !report.stopped();) {
      progress = false;
      for (Index v = 0; v < m_.vertex_slots(); ++v)
        if (m_.alive_vertex(v)) push(v);
      for (Index v = queue_.pop(); v != kNone; v = queue_.pop()) {
        if (!m_.alive_vertex(v)) continue;
        const Choice c = best(v);
        if (c.half == kNone) continue;
        if (c.cost > entered_[v] * 1.001) {
          enter(v, c.cost);
          continue;
        }
        progress = true;
        collapse(c);
        if (++gone % 256 == 0) report.at(double(gone) / double(m_.vertex_slots()));
        if (report.stopped()) break;
      }
    }
    recorder_.base(m_);
    CollapsedSets out;
    for (Index v = 0; v < m_.vertex_slots() && !out.left_over; ++v)
      if (m_.alive_vertex(v) && sets_.representative[sets_.set[v]] != v)
        out.left_over = m_.position(v);
    std::ranges::sort(turned_);
    turned_.erase(std::ranges::unique(turned_).begin(), turned_.end());
    out.turned = std::move(turned_);
    if (!out.left_over) out.mesh = renumbered(std::move(recorder_.mesh));
    return out;
  }

 private:
  struct Choice {
    Index half = kNone;
    double cost = HUGE_VAL;
    Vec3 at;
  };

  CappedModels& models_;
  HalfedgeMesh& m_;  // vertices lie where they have come to
  const VertexSets& sets_;
  std::span<const SetPlan> plans_;
  const SpaceLattice* lattice_;
  CappedMeasure measure_;
  SplitRecorder<CappedMeasure> recorder_;
  std::vector<QuadricN<3>> quadric_;  // relative to where the vertex started
  std::vector<std::size_t> size_;     // of each set
  std::vector<double> entered_;       // the cost that the queue knows
  VertexQueue queue_;
  std::vector<Index> turned_;

  static PointN<3> point(const Vec3& p) { return {p.x, p.y, p.z}; }
  static std::array<float, 3> offset(const Vec3& from, const Vec3& to) {
    return {float(to.x - from.x), float(to.y - from.y), float(to.z - from.z)};
  }
  const Vec3& start(Index v) const { return measure_.carried().start(v); }

  void add_triangle(Index h) {
    for (Index k = h; k < h + 3; ++k)
      if (models_.fine_cap(m_.origin(k))) return add_wall(HalfedgeMesh::next(k));
    const Vec3 &a = m_.position(m_.origin(h)), &b = m_.position(m_.origin(h + 1)),
               &c = m_.position(m_.origin(h + 2));
    const double area = length(cross(b - a, c - a)) / 2;
    const auto q = QuadricN<3>::of_triangle(point(a), point(b), point(c), area, 1e-5 * area);
    for (Index k = h; k < h + 3; ++k) quadric_[m_.origin(k)].add(q);
  }
  /// Along border edge h, at right angles to its triangle: so that the border keeps its shape.
  void add_wall(Index h) {
    const Index g = m_.twin(h);
    const Vec3 &a = m_.position(m_.origin(g)), &b = m_.position(m_.dest(g));
    const Vec3 along = b - a, out = cross(along, cross(along, m_.position(m_.apex(g)) - a));
    const double square = dot(out, out);
    if (square == 0) return;
    const auto q = QuadricN<3>::of_plane({out.x, out.y, out.z}, dot(along, along) / square, 0);
    quadric_[m_.origin(g)].add(q), quadric_[m_.dest(g)].add(q);
  }

  bool border_edge(Index h) const {
    return models_.fine_cap(m_.apex(h)) || models_.fine_cap(m_.apex(m_.twin(h)));
  }

  /// Whether the collapse of h to `at` turns a triangle by 90 degrees or more.
  bool turns_over(Index h, const Vec3& at) const {
    return !m_.all_kept(h, [&](Index e) {
      const Index a = m_.dest(e), b = m_.apex(e);
      if (models_.fine_cap(a) || models_.fine_cap(b)) return true;
      const Vec3 side = m_.position(b) - m_.position(a);
      const Vec3 was = cross(side, m_.position(m_.origin(e)) - m_.position(a));
      const Vec3 now = cross(side, at - m_.position(a));
      return !(dot(was, now) <= kCosine * length(was) * length(now) && dot(was, was) > 0);
    });
  }

  /// On the straight line from where the vertex of a set started to where the coarse model has it.
  Vec3 on_schedule(Index into, std::size_t gone) const {
    const Index set = sets_.set[into];
    const Vec3& to = models_.coarse.position(set);
    if (gone + 1 == size_[set]) return to;
    const double s = std::pow(double(gone) / double(size_[set] - 1), plans_[set].pace);
    return start(into) * (1 - s) + to * s;
  }

  Vec3 snapped(const Vec3& p) const { return lattice_ ? lattice_->snap(p) : p; }

  Choice best(Index v) const {
    Choice c;
    const Index set = sets_.set[v];
    if (sets_.representative[set] == v) return c;
    const bool border = on_border(models_, v);
    m_.for_each_out(v, [&](Index h) {
      const Index to = m_.dest(h);
      if (sets_.set[to] != set || (border && !border_edge(h)) || !m_.link_ok(h)) return;
      const Vec3 way = m_.position(to) - m_.position(v);
      const double cost = plans_[set].shortest_first
                              ? dot(way, way)
                              : std::max(0.0f, quadric_[v].value(offset(start(v), start(to))));
      if (cost >= c.cost) return;
      const std::size_t gone = measure_.carried().weight(v) + measure_.carried().weight(to) - 1;
      const Vec3 goal = on_schedule(to, gone);
      const bool last = gone + 1 == size_[set];
      const std::array<Vec3, 4> places = {goal, (goal + m_.position(to)) * 0.5, m_.position(to),
                                          m_.position(v)};
      const std::size_t choice = last ? 1 : border || !on_border(models_, to) ? 4 : 3;
      for (std::size_t i = 0; i < choice; ++i) {
        const Vec3 at = snapped(places[i]);
        if (turns_over(h, at)) continue;
        c = {h, cost, at};
        return;
      }
      if (cost + kTurned < c.cost) c = {h, cost + kTurned, snapped(goal)};
    });
    return c;
  }
  void enter(Index v, double cost) {
    entered_[v] = cost;
    queue_.push(v, cost);
  }
  void push(Index v) { enter(v, best(v).cost); }

  Index open(Index v) const { return models_.fine_cap(v) ? kNone : v; }

  void collapse(const Choice& c) {
    const Index v = m_.origin(c.half), to = m_.dest(c.half);
    if (c.cost >= kTurned) turned_.push_back(sets_.set[to]);
    quadric_[v].move_origin(offset(start(v), start(to)));
    quadric_[to].add(quadric_[v]);
    Collapse told = collapse_of(m_, c.half, c.at);
    told.left = open(told.left), told.right = open(told.right);
    recorder_.collapse(told);
    m_.collapse(c.half);
    m_.position(to) = c.at;
    // The link condition looks one ring further than the cost.
    push(to);
    m_.for_each_out(to, [&](Index e) {
      push(m_.dest(e));
      m_.for_each_out(m_.dest(e), [&](Index f) {
        if (sets_.set[m_.dest(f)] == sets_.set[to]) push(m_.dest(f));
      });
    });
  }

  /// From the closed fine model's order to the open coarse one's.
  ProgressiveMesh renumbered(ProgressiveMesh pm) const {
    std::vector<Index> number;  // of the recorder's base: the coarse vertex, caps last
    for (Index v = 0; v < m_.vertex_slots(); ++v)
      if (m_.alive_vertex(v)) number.push_back(sets_.set[v]);
    const Index was = Index(number.size());
    const auto now = [&](Index v) {
      return v == kNone ? kNone : v < was ? number[v] : v - models_.caps;
    };
    Tin base;
    base.vertices.resize(was);
    for (Index i = 0; i < was; ++i) base.vertices[number[i]] = pm.base.vertices[i];
    base.vertices.resize(was - models_.caps);
    for (const Triangle& t : pm.base.triangles)
      if (!std::ranges::any_of(t, [&](Index v) { return models_.coarse_cap(number[v]); }))
        base.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    pm.base = std::move(base);
    for (VertexSplit& s : pm.splits)
      s.vertex = now(s.vertex), s.left = now(s.left), s.right = now(s.right);
    return pm;
  }
};

}  // namespace

CollapsedSets collapse_sets(CappedModels models, const VertexSets& sets,
                            std::span<const SetPlan> plans, const SpaceLattice* lattice,
                            const Progress& progress) {
  return SetCollapser(models, sets, plans, lattice).run(progress);
}

}  // namespace tind
