// Corners (one per triangle and vertex) are joined across every edge that has exactly one triangle
// on either side. What is joined is one fan; every fan gets a vertex of its own.

#include "terrain/mesh/manifold.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace tind {

namespace {

using Index = std::uint32_t;
constexpr Index kNone = ~Index(0);

Index next(Index corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

struct DirectedEdge {
  Index low, high, half_edge;
  bool forward;  // from low to high
};

std::vector<DirectedEdge> sorted_edges(const Tin& tin) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * tin.triangles.size());
  for (Index t = 0; t < tin.triangles.size(); ++t) {
    for (Index k = 0; k < 3; ++k) {
      const Index a = tin.triangles[t][k], b = tin.triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), 3 * t + k, a < b});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const DirectedEdge& x, const DirectedEdge& y) {
    if (x.low != y.low) return x.low < y.low;
    if (x.high != y.high) return x.high < y.high;
    return x.half_edge < y.half_edge;
  });
  return edges;
}

template <class F>
void for_each_edge(const std::vector<DirectedEdge>& edges, F&& f) {
  for (std::size_t i = 0, j; i < edges.size(); i = j) {
    for (j = i + 1;
         j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high;)
      ++j;
    f(i, j);
  }
}

template <class Keep>
std::size_t drop_triangles(Tin& tin, Keep&& keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < tin.triangles.size(); ++t)
    if (keep(t)) tin.triangles[kept++] = tin.triangles[t];
  const std::size_t dropped = tin.triangles.size() - kept;
  tin.triangles.resize(kept);
  return dropped;
}

std::size_t drop_degenerate(Tin& tin) {
  const std::size_t n = tin.vertices.size();
  return drop_triangles(tin, [&](std::size_t i) {
    const Triangle& t = tin.triangles[i];
    return t[0] < n && t[1] < n && t[2] < n && t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
  });
}

class Fans {
 public:
  explicit Fans(std::size_t corners) : parent_(corners) {
    std::iota(parent_.begin(), parent_.end(), Index(0));
  }
  Index root(Index i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(Index i, Index j) {
    i = root(i), j = root(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<Index> parent_;
};

template <class T>
void append_copy(std::vector<T>& values, Index i) {
  if (values.empty()) return;
  const T copy = values[i];
  values.push_back(copy);
}

std::size_t split_fans(Tin& tin) {
  Fans fans(3 * tin.triangles.size());
  const std::vector<DirectedEdge> edges = sorted_edges(tin);
  for_each_edge(edges, [&](std::size_t i, std::size_t j) {
    if (j - i != 2 || edges[i].forward == edges[i + 1].forward) return;
    const Index h = edges[i].half_edge, g = edges[i + 1].half_edge;
    fans.join(h, next(g));
    fans.join(next(h), g);
  });
  const std::size_t before = tin.vertices.size();
  std::vector<Index> owner(before, kNone);  // the fan that keeps the vertex
  std::vector<Index> vertex_of(3 * tin.triangles.size(), kNone);
  for (Index corner = 0; corner < vertex_of.size(); ++corner) {
    Index& v = tin.triangles[corner / 3][corner % 3];
    const Index fan = fans.root(corner);  // the lowest corner of the fan, so it is met first
    if (vertex_of[fan] == kNone) {
      if (owner[v] == kNone) {
        owner[v] = fan;
        vertex_of[fan] = v;
      } else {
        vertex_of[fan] = Index(tin.vertices.size());
        append_copy(tin.vertices, v);
        append_copy(tin.colours, v);
        append_copy(tin.normals, v);
        append_copy(tin.texcoords, v);
      }
    }
    v = vertex_of[fan];
  }
  return tin.vertices.size() - before;
}

/// Of triangles that still use an edge in the same direction, the first stays.
std::size_t drop_repeated_edges(Tin& tin) {
  std::vector<std::uint8_t> bad(tin.triangles.size(), 0);
  const std::vector<DirectedEdge> edges = sorted_edges(tin);
  for_each_edge(edges, [&](std::size_t i, std::size_t j) {
    bool used[2] = {false, false};
    for (; i < j; ++i) {
      if (bad[edges[i].half_edge / 3]) continue;
      bool& here = used[edges[i].forward];
      if (here) bad[edges[i].half_edge / 3] = 1;
      here = true;
    }
  });
  return drop_triangles(tin, [&](std::size_t t) { return !bad[t]; });
}

template <class T>
void move_value(std::vector<T>& values, Index from, Index to) {
  if (!values.empty()) values[to] = values[from];
}

template <class T>
void shorten(std::vector<T>& values, Index n) {
  if (!values.empty()) values.resize(n);
}

/// Moves the vertices that `keep` wants together and renames them in the triangles.
template <class Keep>
std::size_t keep_vertices(Tin& tin, Keep&& keep) {
  const Index n = Index(tin.vertices.size());
  std::vector<Index> place(n, kNone);
  Index kept = 0;
  for (Index v = 0; v < n; ++v) {
    if (!keep(v)) continue;
    move_value(tin.vertices, v, kept);
    move_value(tin.colours, v, kept);
    move_value(tin.normals, v, kept);
    move_value(tin.texcoords, v, kept);
    place[v] = kept++;
  }
  shorten(tin.vertices, kept), shorten(tin.colours, kept);
  shorten(tin.normals, kept), shorten(tin.texcoords, kept);
  for (Triangle& t : tin.triangles)
    for (Index& v : t)
      if (v < n) v = place[v];
  return n - kept;
}

}  // namespace

ManifoldRepair make_manifold(Tin& tin) {
  ManifoldRepair repair;
  repair.dropped_triangles = drop_degenerate(tin);
  for (;;) {  // dropping a triangle can cut a fan in two
    repair.split_vertices += split_fans(tin);
    const std::size_t dropped = drop_repeated_edges(tin);
    repair.dropped_triangles += dropped;
    if (dropped == 0) return repair;
  }
}

std::size_t weld(Tin& tin) {
  const Index n = Index(tin.vertices.size());
  auto key_less = [&](Index a, Index b) {
    const Vec3 &p = tin.vertices[a], &q = tin.vertices[b];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    if (p.z != q.z) return p.z < q.z;
    if (!tin.colours.empty() && tin.colours[a] != tin.colours[b])
      return tin.colours[a] < tin.colours[b];
    if (!tin.normals.empty() && tin.normals[a] != tin.normals[b])
      return tin.normals[a] < tin.normals[b];
    if (!tin.texcoords.empty() && tin.texcoords[a] != tin.texcoords[b])
      return tin.texcoords[a] < tin.texcoords[b];
    return false;
  };
  std::vector<Index> order(n), first(n);
  std::iota(order.begin(), order.end(), Index(0));
  std::stable_sort(order.begin(), order.end(), key_less);
  for (Index i = 0; i < n; ++i)
    first[order[i]] = i > 0 && !key_less(order[i - 1], order[i]) ? first[order[i - 1]] : order[i];
  for (Triangle& t : tin.triangles)
    for (Index& v : t)
      if (v < n) v = first[v];
  return keep_vertices(tin, [&](Index v) { return first[v] == v; });
}

std::size_t drop_unused_vertices(Tin& tin) {
  std::vector<std::uint8_t> used(tin.vertices.size(), 0);
  for (const Triangle& t : tin.triangles)
    for (const Index v : t) used[v] = 1;
  return keep_vertices(tin, [&](Index v) { return used[v]; });
}

}  // namespace tind
