#include "terrain/progressive/between.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "terrain/progressive/vertex_sets.h"
#include "terrain/simplify/quadric_n.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr double kTurned = 1e30;  // added to the cost of a collapse that turns a triangle over

class SetCollapser {
 public:
  SetCollapser(HalfedgeMesh& fine, const Tin& coarse, const VertexSets& sets)
      : m_(fine), coarse_(coarse), sets_(sets), version_(fine.vertex_slots(), 0) {
    const std::size_t n = m_.vertex_slots();
    quadric_.resize(n);
    size_.assign(coarse.vertices.size(), 0);
    members_.resize(n);
    for (Index v = 0; v < n; ++v) start_.push_back(m_.position(v));
    for (Index v = 0; v < n; ++v) ++size_[sets.set[v]], members_[v] = {v};
    for (Index h = 0; h < m_.halfedge_slots(); h += 3) add_triangle(h);
  }

  /// All collapses, and what they record, the last first.
  void run() {
    for (Index v = 0; v < m_.vertex_slots(); ++v) push(v);
    while (!queue_.empty()) {
      const Entry e = queue_.top();
      queue_.pop();
      if (e.version != version_[e.vertex] || !m_.alive_vertex(e.vertex)) continue;
      const Choice c = best(e.vertex);
      if (c.half != kNone) collapse(c.half);
    }
  }
  struct Removed {
    Index vertex, into, left, right;
    Vec3 into_coarse, into_fine, at;
    double error;
  };
  const std::vector<Removed>& removed() const { return removed_; }

 private:
  struct Choice {
    Index half = kNone;
    double cost = HUGE_VAL;
  };
  struct Entry {
    double cost;
    Index vertex;
    std::uint32_t version;
    bool operator<(const Entry& o) const {
      return cost != o.cost ? cost > o.cost : vertex > o.vertex;
    }
  };

  HalfedgeMesh& m_;
  const Tin& coarse_;
  const VertexSets& sets_;
  std::vector<std::uint32_t> version_;
  std::vector<QuadricN<3>> quadric_;
  std::vector<Vec3> start_;                  // of each fine vertex
  std::vector<std::vector<Index>> members_;  // the fine vertices that one stands for
  std::vector<std::size_t> size_;            // of each set
  std::vector<Removed> removed_;
  std::priority_queue<Entry> queue_;
  double error_ = 0;

  static PointN<3> point(const Vec3& p) { return {p.x, p.y, p.z}; }
  void add_triangle(Index h) {
    const Vec3 &a = m_.position(m_.origin(h)), &b = m_.position(m_.origin(h + 1)),
               &c = m_.position(m_.origin(h + 2));
    const double area = length(cross(b - a, c - a)) / 2;
    for (Index k = h; k < h + 3; ++k)
      quadric_[m_.origin(k)].add(
          QuadricN<3>::of_triangle(point(a), point(b), point(c), area, 1e-5 * area));
  }

  static std::array<float, 3> offset(const Vec3& from, const Vec3& to) {
    return {float(to.x - from.x), float(to.y - from.y), float(to.z - from.z)};
  }
  bool turns_over(Index h) const {
    const Index v = m_.origin(h), to = m_.dest(h);
    bool turned = false;
    m_.for_each_out(v, [&](Index e) {
      const Index a = m_.dest(e), b = m_.apex(e);
      if (a == to || b == to) return;
      const Vec3 side = m_.position(b) - m_.position(a);
      const Vec3 was = cross(side, m_.position(v) - m_.position(a));
      const Vec3 now = cross(side, m_.position(to) - m_.position(a));
      turned = turned || dot(was, now) <= 0;
    });
    return turned;
  }
  Choice best(Index v) const {
    Choice c;
    const Index set = sets_.set[v];
    if (sets_.representative[set] == v) return c;
    m_.for_each_out(v, [&](Index h) {
      const Index to = m_.dest(h);
      if (sets_.set[to] != set || !m_.link_ok(h)) return;
      double cost = std::max(0.0f, quadric_[v].value(offset(start_[v], start_[to])));
      if (turns_over(h)) cost += kTurned;
      if (cost < c.cost) c = {h, cost};
    });
    return c;
  }
  void push(Index v) {
    ++version_[v];
    if (const Choice c = best(v); c.half != kNone) queue_.push({c.cost, v, version_[v]});
  }

  /// Where a vertex is that stands for so many of its set: on its way to the coarse model's.
  Vec3 placed(Index v) const {
    const Index set = sets_.set[v];
    const std::size_t gone = members_[v].size() - 1;
    if (gone == 0) return start_[v];
    if (gone + 1 == size_[set]) return coarse_.vertices[set];
    const double s = double(gone) / double(size_[set] - 1);
    return start_[v] * (1 - s) + coarse_.vertices[set] * s;
  }

  void collapse(Index h) {
    const Index v = m_.origin(h), to = m_.dest(h);
    Removed r{v, to, m_.apex(h), m_.apex(m_.twin(h)), {}, placed(to), placed(v), 0};
    quadric_[v].move_origin(offset(start_[v], start_[to]));
    quadric_[to].add(quadric_[v]);
    members_[to].insert(members_[to].end(), members_[v].begin(), members_[v].end());
    members_[v] = {};
    m_.collapse(h);
    r.into_coarse = placed(to);
    for (const Index k : members_[to]) error_ = std::max(error_, length(start_[k] - r.into_coarse));
    r.error = error_;
    removed_.push_back(r);
    // The link condition looks one ring further than the cost.
    push(to);
    m_.for_each_out(to, [&](Index e) {
      push(m_.dest(e));
      m_.for_each_out(m_.dest(e), [&](Index f) {
        if (sets_.set[m_.dest(f)] == sets_.set[to]) push(m_.dest(f));
      });
    });
  }
};

std::string place(const Vec3& p) {
  return "(" + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) + ")";
}

/// The triangles that are left must be the coarse model's.
Result<void> arrived(const HalfedgeMesh& m, const VertexSets& sets, const Tin& coarse) {
  for (Index v = 0; v < m.vertex_slots(); ++v)
    if (m.alive_vertex(v) && sets.representative[sets.set[v]] != v)
      return fail(Errc::unsupported, "no collapse inside the set of coarse vertex " +
                                         std::to_string(sets.set[v]) +
                                         " takes away the vertex at " + place(m.position(v)));
  const auto turned = [](Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::vector<Triangle> want, have;
  for (const Triangle& t : coarse.triangles) want.push_back(turned(t));
  for (Index h = 0; h < m.halfedge_slots(); h += 3)
    if (m.alive_triangle(h / 3))
      have.push_back(
          turned({sets.set[m.origin(h)], sets.set[m.origin(h + 1)], sets.set[m.origin(h + 2)]}));
  std::sort(want.begin(), want.end());
  std::sort(have.begin(), have.end());
  if (want == have) return {};
  for (const Triangle& t : want)
    if (!std::binary_search(have.begin(), have.end(), t))
      return fail(Errc::unsupported, "the coarse triangle at " + place(coarse.vertices[t[0]]) +
                                         " does not come about: are the two of the same surface?");
  return fail(Errc::unsupported, "more is left than the coarse model has");
}

Result<HalfedgeMesh> closed_model(const Tin& tin, const char* which) {
  auto m = HalfedgeMesh::from_tin(tin);
  if (!m) return fail(which, m.error());
  const std::string model = "the " + std::string(which) + " model ";
  std::vector<char> seen(tin.vertices.size(), 0);
  std::vector<Index> stack;
  for (Index v = 0; v < m->vertex_slots(); ++v) {
    if (!m->alive_vertex(v))
      return fail(Errc::invalid_argument,
                  model + "has a vertex without triangles at " + place(m->position(v)));
    if (m->on_border(v))
      return fail(Errc::invalid_argument, model + "is not closed at " + place(m->position(v)));
  }
  if (tin.vertices.size() < 4) return fail(Errc::invalid_argument, model + "is empty");
  stack.push_back(0), seen[0] = 1;
  std::size_t reached = 0;
  for (; !stack.empty(); ++reached) {
    const Index v = stack.back();
    stack.pop_back();
    m->for_each_out(v, [&](Index h) {
      if (!std::exchange(seen[m->dest(h)], 1)) stack.push_back(m->dest(h));
    });
  }
  if (reached < seen.size()) return fail(Errc::invalid_argument, model + "is in several parts");
  return m;
}

}  // namespace

Result<BetweenModels> between_models(const Tin& fine, const Tin& coarse) {
  auto m = closed_model(fine, "fine");
  if (!m) return std::unexpected(m.error());
  const auto c = closed_model(coarse, "coarse");
  if (!c) return std::unexpected(c.error());
  const auto euler = [](const Tin& t) {
    return std::int64_t(t.vertices.size()) - std::int64_t(t.triangles.size()) / 2;
  };
  if (euler(fine) != euler(coarse))
    return fail(Errc::invalid_argument, "the two models differ in their number of handles");
  if (coarse.vertices.size() > fine.vertices.size())
    return fail(Errc::invalid_argument, "the coarse model has more vertices than the fine one");
  const auto sets = vertex_sets(*m, *c);
  if (!sets) return std::unexpected(sets.error());
  SetCollapser collapser(*m, coarse, *sets);
  collapser.run();
  if (const auto ok = arrived(*m, *sets, coarse); !ok) return std::unexpected(ok.error());

  BetweenModels out;
  out.split_in = sets->split_in;
  out.mesh.base.vertices = coarse.vertices;
  out.mesh.base.triangles = coarse.triangles;
  std::vector<Index> number(m->vertex_slots(), kNone);
  for (Index j = 0; j < sets->representative.size(); ++j) number[sets->representative[j]] = j;
  const auto& removed = collapser.removed();
  for (auto r = removed.rbegin(); r != removed.rend(); ++r) {
    number[r->vertex] = Index(coarse.vertices.size() + out.mesh.splits.size());
    out.mesh.splits.push_back({number[r->into], number[r->left], number[r->right], r->into_coarse,
                               r->into_fine, r->at, float(r->error)});
  }
  return out;
}

}  // namespace tind
