#include "terrain/progressive/between/vertex_sets.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <numeric>
#include <queue>
#include <set>

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr double kForeign = 4;  // how much more a step costs in a set of neither end
constexpr double kSplit = 8;    // and one across an edge that must be split

/// Models whose edges wind around each other need ever more; those of one surface a few.
std::size_t most_splits(std::size_t fine_vertices) { return 20000 + 4 * fine_vertices; }

using Pair = std::pair<Index, Index>;
Pair ordered(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

class Router {
 public:
  Router(CappedModels& models, VertexSets& out)
      : models_(models),
        m_(models.fine),
        c_(models.coarse),
        out_(out),
        first_(c_.halfedge_slots(), kNone) {}

  Result<void> run(const Progress& progress) {
    choose_representatives();
    nearest_ = grown();
    out_.set.assign(m_.vertex_slots(), kNone);
    for (Index j = 0; j < c_.vertex_slots(); ++j) out_.set[out_.representative[j]] = j;
    const std::vector<Index> edges = edges_trees_first();
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (progress.stopped()) return fail(Errc::cancelled, "it was stopped");
      if (auto ok = route(edges[i]); !ok) return ok;
      if (out_.split_in > most_splits(models_.first_fine_cap)) return too_unlike(edges[i]);
      progress.at(double(i + 1) / double(edges.size()));
    }
    fill();
    return {};
  }

 private:
  /// A vertex, or an edge with both ends taken that would be split: its two ends.
  struct Node {
    Index a = kNone, b = kNone;
    bool is_vertex() const { return b == kNone; }
    friend auto operator<=>(const Node&, const Node&) = default;
  };

  CappedModels& models_;
  HalfedgeMesh& m_;
  const HalfedgeMesh& c_;
  VertexSets& out_;
  std::vector<Index> first_;    // by coarse half-edge: the first vertex of its path
  std::vector<Index> nearest_;  // the paper's sets, by number of edges
  std::set<Pair> path_edges_;

  Vec3 at(const Node& n) const {
    return n.is_vertex() ? m_.position(n.a) : (m_.position(n.a) + m_.position(n.b)) * 0.5;
  }
  bool taken(Index v) const { return out_.set[v] != kNone; }

  void choose_representatives() {
    out_.representative = models_.representative;
    std::vector<char> used(m_.vertex_slots(), 0);  // or on a border
    for (Index v = 0; v < m_.vertex_slots(); ++v) {
      if (!models_.fine_cap(v)) continue;
      used[v] = 1;
      m_.for_each_out(v, [&](Index h) { used[m_.dest(h)] = 1; });
    }
    for (Index j = 0; j < c_.vertex_slots(); ++j) {
      if (out_.representative[j] != kNone) continue;
      Index best = kNone;
      double least = HUGE_VAL;
      for (Index v = 0; v < m_.vertex_slots(); ++v) {
        const double d = length(m_.position(v) - c_.position(j));
        if (!used[v] && d < least) least = d, best = v;
      }
      if (best == kNone) {
        best = split_inside();
        used.push_back(0);
      }
      used[best] = 1;
      out_.representative[j] = best;
    }
  }

  /// The longest edge that is not the border's, where borders have all vertices that there are.
  Index split_inside() {
    Index longest = kNone;
    double most = -1;
    for (Index h = 0; h < m_.halfedge_slots(); ++h) {
      const double l = length(m_.position(m_.origin(h)) - m_.position(m_.dest(h)));
      if (l > most && !at_cap(m_, h, true)) longest = h, most = l;
    }
    ++out_.split_in;
    return m_.split_edge(longest,
                         (m_.position(m_.origin(longest)) + m_.position(m_.dest(longest))) * 0.5);
  }

  /// Whether a cap is at one of the edge's ends or, if asked, at one of the two corners beside it.
  bool at_cap(const HalfedgeMesh& m, Index h, bool beside) const {
    const auto cap = [&](Index v) {
      return &m == &m_ ? models_.fine_cap(v) : models_.coarse_cap(v);
    };
    return cap(m.origin(h)) || cap(m.dest(h)) ||
           (beside && (cap(m.apex(h)) || cap(m.apex(m.twin(h)))));
  }

  /// Graph Voronoi.
  std::vector<Index> grown() const {
    std::vector<Index> label(m_.vertex_slots(), kNone);
    std::deque<Index> queue;
    for (Index j = 0; j < c_.vertex_slots(); ++j) {
      label[out_.representative[j]] = j;
      if (!models_.coarse_cap(j)) queue.push_back(out_.representative[j]);
    }
    spread(queue, label);
    return label;
  }
  void spread(std::deque<Index>& queue, std::vector<Index>& label) const {
    for (; !queue.empty(); queue.pop_front()) {
      const Index v = queue.front();
      m_.for_each_out(v, [&](Index h) {
        if (label[m_.dest(h)] != kNone || models_.fine_cap(v)) return;
        label[m_.dest(h)] = label[v];
        queue.push_back(m_.dest(h));
      });
    }
  }

  /// One half-edge for each coarse edge: those of caps, of borders, a spanning tree, and the rest,
  /// short ones first.
  std::vector<Index> edges_trees_first() const {
    struct Edge {
      int kind;
      double length;
      Index half;
      auto operator<=>(const Edge&) const = default;
    };
    std::vector<Edge> all;
    for (Index h = 0; h < c_.halfedge_slots(); ++h) {
      if (h > c_.twin(h)) continue;
      const int kind = at_cap(c_, h, false) ? 0 : at_cap(c_, h, true) ? 1 : 2;
      all.push_back({kind,
                     length(m_.position(out_.representative[c_.origin(h)]) -
                            m_.position(out_.representative[c_.dest(h)])),
                     h});
    }
    std::sort(all.begin(), all.end());
    std::vector<Index> root(c_.vertex_slots());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](Index v) {
      while (root[v] != v) v = root[v] = root[root[v]];
      return v;
    };
    std::vector<Index> tree, rest;
    for (const Edge& e : all) {
      const Index a = find(c_.origin(e.half)), b = find(c_.dest(e.half));
      (a == b && e.kind == 2 ? rest : tree).push_back(e.half);
      root[a] = b;
    }
    tree.insert(tree.end(), rest.begin(), rest.end());
    return tree;
  }

  /// Where a path may leave the representative: between the paths that are its neighbours in the
  /// coarse model's order.
  std::set<Node> gate(Index coarse_half) const {
    Index before = kNone, after = kNone;
    for (Index h = c_.rotate_ccw(coarse_half); h != coarse_half; h = c_.rotate_ccw(h)) {
      if (first_[h] == kNone) continue;
      if (after == kNone) after = first_[h];
      before = first_[h];
    }
    std::set<Node> out;
    const Index rep = out_.representative[c_.origin(coarse_half)];
    Index h = m_.out(rep);
    if (before != kNone)
      while (m_.dest(h) != before) h = m_.rotate_ccw(h);
    const Index start = h;
    do {
      if (m_.dest(h) != before && m_.dest(h) != after) out.insert({m_.dest(h), kNone});
      if (crossable(HalfedgeMesh::next(h))) out.insert(crossing(HalfedgeMesh::next(h)));
      h = m_.rotate_ccw(h);
    } while (h != start && m_.dest(h) != after);
    return out;
  }
  bool crossable(Index h) const {
    const Index a = m_.origin(h), b = m_.dest(h);
    return taken(a) && taken(b) && !models_.fine_cap(a) && !models_.fine_cap(b) &&
           !path_edges_.contains(ordered(a, b));
  }
  Node crossing(Index h) const {
    const auto [a, b] = ordered(m_.origin(h), m_.dest(h));
    return {a, b};
  }

  template <class F>
  void each_step(const Node& n, F&& f) const {
    const auto to_vertex = [&](Index v) {
      if (!taken(v)) f(Node{v, kNone});
    };
    if (n.is_vertex()) {
      m_.for_each_out(n.a, [&](Index h) {
        to_vertex(m_.dest(h));
        if (crossable(HalfedgeMesh::next(h))) f(crossing(HalfedgeMesh::next(h)));
      });
      return;
    }
    const Index h = m_.find(n.a, n.b);
    for (const Index side : {h, m_.twin(h)}) {
      to_vertex(m_.apex(side));
      for (const Index e : {HalfedgeMesh::next(side), HalfedgeMesh::prev(side)})
        if (crossable(e)) f(crossing(e));
    }
  }

  /// The border from one representative to the next. `coarse_half` has the cap on its left.
  void lay_border(Index coarse_half) {
    const Index to = out_.representative[c_.dest(coarse_half)];
    const Index cap = out_.representative[c_.apex(coarse_half)];
    std::vector<Node> path;
    for (Index v = out_.representative[c_.origin(coarse_half)];;) {
      m_.for_each_out(v, [&](Index h) { v = m_.apex(h) == cap ? m_.dest(h) : v; });
      if (v == to) break;
      path.push_back({v, kNone});
    }
    lay(coarse_half, path);
  }

  /// Dijkstra from one gate to the other.
  Result<void> route(Index coarse_half) {
    if (at_cap(c_, coarse_half, false)) {
      lay(coarse_half, {});
      return {};
    }
    for (const Index h : {coarse_half, c_.twin(coarse_half)}) {
      if (!models_.coarse_cap(c_.apex(h))) continue;
      lay_border(h);
      return {};
    }
    const Index a = c_.origin(coarse_half), b = c_.dest(coarse_half);
    const Index rep_a = out_.representative[a], rep_b = out_.representative[b];
    const std::set<Node> leave = gate(coarse_half), arrive = gate(c_.twin(coarse_half));
    if (leave.contains({rep_b, kNone}) && arrive.contains({rep_a, kNone})) {
      lay(coarse_half, {});
      return {};
    }
    std::map<Node, std::pair<double, Node>> best;  // cost, from where
    using Entry = std::pair<double, Node>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    const auto reach = [&](const Node& n, const Vec3& from, double cost, const Node& by) {
      const bool home = n.is_vertex() && (nearest_[n.a] == a || nearest_[n.a] == b);
      cost += length(at(n) - from) * (home ? 1 : n.is_vertex() ? kForeign : kSplit);
      const auto [found, fresh] = best.try_emplace(n, cost, by);
      if (!fresh && found->second.first <= cost) return;
      found->second = {cost, by};
      queue.push({cost, n});
    };
    for (const Node& n : leave)
      if (!n.is_vertex() || !taken(n.a)) reach(n, m_.position(rep_a), 0, {});
    while (!queue.empty()) {
      const auto [cost, n] = queue.top();
      queue.pop();
      if (best[n].first < cost) continue;
      if (arrive.contains(n)) {
        std::vector<Node> path;
        for (Node k = n; k != Node{}; k = best[k].second) path.push_back(k);
        std::reverse(path.begin(), path.end());
        lay(coarse_half, path);
        return {};
      }
      each_step(n, [&, c = cost, from = n](const Node& to) { reach(to, at(from), c, from); });
    }
    const Vec3& p = m_.position(rep_a);
    return fail(Errc::unsupported,
                "the coarse edge " + std::to_string(a) + "-" + std::to_string(b) +
                    " finds no way on the fine model from (" + std::to_string(p.x) + ", " +
                    std::to_string(p.y) + ", " + std::to_string(p.z) +
                    "): are the two models of the same surface?");
  }

  Result<void> too_unlike(Index coarse_half) const {
    const Vec3& p = c_.position(c_.origin(coarse_half));
    return fail(Errc::unsupported, "the two models are too unlike: at (" + std::to_string(p.x) +
                                       ", " + std::to_string(p.y) + ", " + std::to_string(p.z) +
                                       ") of the coarse one, " + std::to_string(out_.split_in) +
                                       " vertices had to be split in, and there is no end");
  }

  void lay(Index coarse_half, const std::vector<Node>& path) {
    const Index a = c_.origin(coarse_half), b = c_.dest(coarse_half);
    std::vector<Index> line = {out_.representative[a]};
    for (const Node& n : path) {
      if (!n.is_vertex()) {
        line.push_back(m_.split_edge(m_.find(n.a, n.b), at(n)));
        out_.set.push_back(kNone);
        nearest_.push_back(nearest_[n.a]);
        ++out_.split_in;
      } else {
        line.push_back(n.a);
      }
    }
    line.push_back(out_.representative[b]);
    first_[coarse_half] = line[1];
    first_[c_.twin(coarse_half)] = line[line.size() - 2];
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
      path_edges_.insert(ordered(line[i], line[i + 1]));
      if (i > 0) out_.set[line[i]] = 2 * i < line.size() ? a : b;
    }
  }

  /// The patches, and a second vertex for every set that has one only.
  void fill() {
    std::deque<Index> queue;
    for (Index v = 0; v < m_.vertex_slots(); ++v)
      if (taken(v)) queue.push_back(v);
    spread(queue, out_.set);
    std::vector<std::size_t> size(c_.vertex_slots(), 0);
    for (const Index j : out_.set) ++size[j];
    for (Index j = 0; j < size.size(); ++j) {
      const Index rep = out_.representative[j];
      if (size[j] > 1 || m_.position(rep) == c_.position(j)) continue;
      Index h = m_.out(rep);
      while (models_.fine_cap(m_.dest(h))) h = m_.rotate_ccw(h);
      m_.split_edge(h, (m_.position(rep) + m_.position(m_.dest(h))) * 0.5);
      out_.set.push_back(j);
      ++out_.split_in;
    }
  }
};

}  // namespace

Result<VertexSets> vertex_sets(CappedModels& models, const Progress& progress) {
  VertexSets out;
  out.split_in = models.split_in;
  if (auto ok = Router(models, out).run(progress); !ok) return std::unexpected(ok.error());
  return out;
}

}  // namespace tind
