// vsplit and ecol on flat half-edges. Before a split of s with neighbours l and r, let e be s -> l
// and f be the half-edge r -> s of the last face that goes over. Afterwards
//
//   a = (n, s, l), b = (s, n, r) are the new faces, and e, f belong to n:
//   n-l is shared by e and a, s-l by a and what was e's twin; r-n by f and b, s-r by b and f's
//   twin.
//
// So the inverse finds e and f as the twins of a's and b's edges, and needs no search.

#include "proto/stream/split_topology.h"

#include <algorithm>

namespace tind::proto {

namespace {

using Index = SplitTopology::Index;

struct Edge {
  Index a, b, h;  // a < b
  friend auto operator<=>(const Edge&, const Edge&) = default;
};

}  // namespace

SplitTopology::SplitTopology(std::span<const Face> faces, std::size_t vertices, std::size_t splits,
                             std::string& problem)
    : base_vertices_(vertices), base_faces_(faces.size()), faces_(faces.size()) {
  origin_.reserve(3 * (faces.size() + 2 * splits));
  twin_.reserve(3 * (faces.size() + 2 * splits));
  out_.reserve(vertices + splits);
  out_.assign(vertices, kNone);
  std::vector<Edge> edges;
  for (const Face& f : faces) {
    for (const Index v : f) {
      if (v >= vertices) {
        problem =
            "a triangle of the base names vertex " + std::to_string(v) + ", which is not there";
        return;
      }
    }
    for (int k = 0; k < 3; ++k) {
      const Index h = Index(origin_.size()), a = f[k], b = f[(k + 1) % 3];
      if (out_[a] == kNone) out_[a] = h;
      if (a == b) {
        problem = "a triangle of the base names vertex " + std::to_string(a) + " twice";
        return;
      }
      edges.push_back({std::min(a, b), std::max(a, b), h});
      origin_.push_back(a);
    }
  }
  twin_.assign(origin_.size(), kNone);
  std::ranges::sort(edges);
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i].a != edges[i + 1].a || edges[i].b != edges[i + 1].b) continue;
    const bool third =
        i + 2 < edges.size() && edges[i + 2].a == edges[i].a && edges[i + 2].b == edges[i].b;
    if (third || origin_[edges[i].h] == origin_[edges[i + 1].h]) {
      problem = "the base is no manifold at the edge " + std::to_string(edges[i].a) + "-" +
                std::to_string(edges[i].b);
      return;
    }
    link(edges[i].h, edges[i + 1].h);
    ++i;
  }
  std::vector<Index> faces_at(vertices, 0);
  for (const Index v : origin_) ++faces_at[v];
  Fan around;
  for (Index v = 0; v < vertices; ++v) {
    if (faces_at[v] > 0) fan(v, around);
    if (faces_at[v] == 0 || around.edges.size() != faces_at[v]) {
      problem = "the triangles of the base at vertex " + std::to_string(v) +
                (faces_at[v] == 0 ? ": there are none" : " form more than one fan");
      return;
    }
  }
  problem.clear();
}

Index SplitTopology::first_out(Index v) const {
  const Index start = out_[v];
  Index h = start;
  while (twin_[h] != kNone) {
    h = next(twin_[h]);
    if (h == start) return start;
  }
  return h;
}

void SplitTopology::fan(Index v, Fan& f) const {
  f.ring.clear();
  f.edges.clear();
  const Index start = first_out(v);
  f.border = false;
  for (Index h = start;;) {
    f.ring.push_back(dest(h));
    f.edges.push_back(h);
    const Index back = prev(h), g = twin_[back];
    if (g == kNone) {
      f.border = true;
      f.ring.push_back(origin_[back]);
      return;
    }
    if (g == start) return;
    h = g;
  }
}

SplitTopology::Place SplitTopology::place(Index vertex, Index left, Index right) const {
  if (left == right) return {};
  const Index start = first_out(vertex);
  const bool closed = twin_[start] != kNone;
  Place found;
  bool ended = false;
  for (Index h = start, turn = 0; turn < (closed ? 2u : 1u) && !ended;) {
    if (dest(h) == left && found.edge == kNone) found.edge = h;
    if (found.edge != kNone && dest(h) == right) return found;
    const Index back = prev(h), g = twin_[back];
    if (g == kNone) {
      const Index last = origin_[back];
      if (last == right && found.edge != kNone) return found;
      if (right == kNone && found.edge != kNone) return found;
      if (right == kNone && last == left) return {back, true};
      ended = true;
    } else {
      h = g;
      turn += h == start;
    }
  }
  return {};
}

void SplitTopology::split(Place p, Index right) {
  const Index a = Index(3 * face_slots()), b = a + 3, n = Index(vertices());
  const Index s = p.lone ? dest(p.edge) : origin_[p.edge];
  const Index l = p.lone ? origin_[p.edge] : dest(p.edge);
  origin_.insert(origin_.end(), {n, s, l, kNone, kNone, kNone});
  twin_.insert(twin_.end(), 6, kNone);
  Index first = kNone, last = kNone;
  if (!p.lone) {
    first = p.edge;
    for (Index h = first;;) {
      origin_[h] = n;
      last = prev(h);
      const Index g = twin_[last];
      if (origin_[last] == right || g == kNone) break;
      h = g;
    }
  }
  link(a + 1, p.lone ? p.edge : twin_[first]);  // s -> l
  link(a + 2, first);                           // l -> n
  if (out_[s] != kNone && origin_[out_[s]] != s) out_[s] = a + 1;
  out_.push_back(a);
  ++faces_;
  if (right != kNone) {
    origin_[b] = s, origin_[b + 1] = n, origin_[b + 2] = right;
    link(b + 2, twin_[last]);  // r -> s
    link(b + 1, last);         // n -> r
    link(a, b);
    ++faces_;
  }
  ++splits_;
}

void SplitTopology::unsplit() {
  --splits_;
  const Index a = Index(3 * face_slots()), b = a + 3;
  const Index s = origin_[a + 1];
  const Index first = twin_[a + 2];
  if (first != kNone) {
    for (Index h = first;;) {
      origin_[h] = s;
      const Index last = prev(h), g = twin_[last];
      if (g == kNone || g >= a) break;
      h = g;
    }
  }
  if (out_[s] >= a) out_[s] = first;
  const Index l = origin_[a + 2];
  const Index beyond = twin_[a + 1];
  if (out_[l] >= a) out_[l] = beyond;
  if (first != kNone)
    link(first, beyond);
  else if (beyond != kNone)
    twin_[beyond] = kNone;
  --faces_;
  if (origin_[b] != kNone) {
    const Index r = origin_[b + 2], last = twin_[b + 1], outside = twin_[b + 2];
    if (out_[r] >= a) out_[r] = last;
    if (last != kNone) twin_[last] = outside;
    if (outside != kNone) twin_[outside] = last;
    --faces_;
  }
  origin_.resize(a);
  twin_.resize(a);
  out_.pop_back();
}

}  // namespace tind::proto
