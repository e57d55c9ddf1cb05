// Vertex by vertex, corners (one per triangle and vertex) are joined across every edge that has
// exactly one triangle on either side. What is joined is one fan; every fan gets a vertex of its
// own.

#include "terrain/mesh/manifold.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>

namespace tind {

namespace {

using Index = std::uint32_t;
constexpr Index kNone = ~Index(0);

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

template <class T>
void append_copy(std::vector<T>& values, Index i) {
  if (values.empty()) return;
  const T copy = values[i];
  values.push_back(copy);
}

/// Of triangles with the same corners in the same sense, the first stays: each further one would
/// make their edges those of three and more triangles, which are taken apart.
std::size_t drop_repeated(Tin& tin) {
  std::vector<std::pair<Triangle, Index>> order;
  order.reserve(tin.triangles.size());
  for (Index t = 0; t < tin.triangles.size(); ++t) {
    Triangle c = tin.triangles[t];
    std::ranges::rotate(c, std::ranges::min_element(c));
    order.emplace_back(c, t);
  }
  std::ranges::sort(order);
  std::vector<std::uint8_t> repeated(tin.triangles.size(), 0);
  for (std::size_t i = 1; i < order.size(); ++i)
    repeated[order[i].second] = order[i].first == order[i - 1].first;
  return drop_triangles(tin, [&](std::size_t t) { return !repeated[t]; });
}

/// The corners of each vertex, in order.
struct CornersByVertex {
  std::vector<Index> offset, corner;

  explicit CornersByVertex(const Tin& tin)
      : offset(tin.vertices.size() + 1, 0), corner(3 * tin.triangles.size()) {
    for (const Triangle& t : tin.triangles)
      for (const Index v : t) ++offset[v + 1];
    for (std::size_t v = 0; v + 1 < offset.size(); ++v) offset[v + 1] += offset[v];
    std::vector<Index> fill(offset.begin(), offset.end() - 1);
    for (Index c = 0; c < corner.size(); ++c) corner[fill[tin.triangles[c / 3][c % 3]]++] = c;
  }
  std::span<const Index> at(Index v) const {
    return {corner.data() + offset[v], corner.data() + offset[v + 1]};
  }
};

/// Sorts the corners of one vertex into fans.
class FansOfVertex {
 public:
  /// By corner: which of them is the first of its fan.
  const std::vector<Index>& sort(const Tin& tin, std::span<const Index> corners) {
    fan_.resize(corners.size());
    std::iota(fan_.begin(), fan_.end(), Index(0));
    sides_.clear();
    for (Index i = 0; i < fan_.size(); ++i) {
      const Triangle& t = tin.triangles[corners[i] / 3];
      const Index k = corners[i] % 3;
      sides_.push_back({t[(k + 1) % 3], true, i});
      sides_.push_back({t[(k + 2) % 3], false, i});
    }
    std::sort(sides_.begin(), sides_.end());
    for (std::size_t i = 0, j; i < sides_.size(); i = j) {
      for (j = i + 1; j < sides_.size() && sides_[j].other == sides_[i].other;) ++j;
      if (j - i == 2 && sides_[i].leaves != sides_[i + 1].leaves)
        join(sides_[i].corner, sides_[i + 1].corner);
    }
    for (Index& f : fan_) f = fan_[f];  // what it points to comes before it
    return fan_;
  }

 private:
  struct Side {  // of a corner: an edge of the vertex
    Index other;
    bool leaves;
    Index corner;
    auto operator<=>(const Side&) const = default;
  };
  std::vector<Side> sides_;
  std::vector<Index> fan_;

  Index root(Index i) {
    while (fan_[i] != i) i = fan_[i] = fan_[fan_[i]];
    return i;
  }
  void join(Index i, Index j) {
    i = root(i), j = root(j);
    fan_[std::max(i, j)] = std::min(i, j);
  }
};

/// A fan that its vertex is not for.
struct ExtraFan {
  Index vertex, first;  // the first of its corners
  std::vector<Index> corners;
};

std::vector<ExtraFan> extra_fans(const Tin& tin) {
  std::vector<ExtraFan> extras;
  FansOfVertex fans;
  std::vector<std::size_t> extra;  // of the vertex at hand: by the first corner of a fan
  const CornersByVertex around(tin);
  for (Index v = 0; v < tin.vertices.size(); ++v) {
    const std::span<const Index> corners = around.at(v);
    const std::vector<Index>& fan = fans.sort(tin, corners);
    extra.resize(std::max(extra.size(), fan.size()));
    for (Index i = 0; i < fan.size(); ++i) {
      if (fan[i] == 0) continue;
      if (fan[i] == i) {
        extra[i] = extras.size();
        extras.push_back({v, corners[i], {}});
      }
      extras[extra[fan[i]]].corners.push_back(corners[i]);
    }
  }
  return extras;
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

std::vector<Index> split_fans(Tin& tin, CopyOrder order) {
  std::vector<ExtraFan> extras = extra_fans(tin);
  if (order == CopyOrder::of_corners) std::ranges::sort(extras, {}, &ExtraFan::first);
  std::vector<Index> copy_of;
  for (const ExtraFan& fan : extras) {
    const auto copy = Index(tin.vertices.size());
    append_copy(tin.vertices, fan.vertex);
    append_copy(tin.colours, fan.vertex);
    append_copy(tin.normals, fan.vertex);
    append_copy(tin.texcoords, fan.vertex);
    for (const Index c : fan.corners) tin.triangles[c / 3][c % 3] = copy;
    copy_of.push_back(fan.vertex);
  }
  return copy_of;
}

ManifoldRepair make_manifold(Tin& tin) {
  ManifoldRepair repair;
  repair.dropped_triangles = drop_degenerate(tin) + drop_repeated(tin);
  const std::size_t before = tin.vertices.size();
  for (;;) {  // dropping a triangle can cut a fan in two
    for (const Index v : split_fans(tin, CopyOrder::of_corners))
      repair.copy_of.push_back(v < before ? v : repair.copy_of[v - before]);
    repair.split_vertices = repair.copy_of.size();
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

bool has_attributes(const Tin& tin) {
  return !tin.colours.empty() || !tin.normals.empty() || !tin.texcoords.empty();
}

void drop_attributes(Tin& tin) { tin.colours.clear(), tin.normals.clear(), tin.texcoords.clear(); }

std::size_t drop_unused_vertices(Tin& tin) {
  std::vector<std::uint8_t> used(tin.vertices.size(), 0);
  for (const Triangle& t : tin.triangles)
    for (const Index v : t) used[v] = 1;
  return keep_vertices(tin, [&](Index v) { return used[v]; });
}

}  // namespace tind
