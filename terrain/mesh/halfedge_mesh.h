#pragma once
// The editable mesh that every method shares: flat half-edge arrays, three half-edges a triangle.
//
// Half-edge h = 3 t + k runs along triangle t from origin(h) to origin(next(h)), with t on its
// left. twin(h) is the same edge seen from the other triangle, kNone on the border. out(v) is one
// half-edge that leaves v; for a border vertex it is the one *on the border* (no twin), so that
// walking counter-clockwise from it visits the whole fan. A removed triangle has origin kNone.
//
// Topology is 12 bytes a half-edge; edits are O(degree) and never allocate, except splits,
// which append.

#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

class HalfedgeMesh {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = ~Index(0);

  HalfedgeMesh() = default;

  /// Any manifold mesh with border. Fails (bad_data) on indices out of range, an edge used twice in
  /// one direction, or a vertex whose triangles form more than one fan.
  static Result<HalfedgeMesh> from_tin(const Tin&);

  /// The grid mesh of cols x rows posts: vertex row * cols + col; each cell is split along the
  /// diagonal from its lower left to its upper right corner. Positions are given in the same
  /// order. REQUIRES: cols, rows >= 2, positions.size() == cols * rows; x grows with col, y falls
  /// with row.
  static HalfedgeMesh from_grid(int cols, int rows, std::vector<Vec3> positions);

  // Without branches: every third guess would be wrong.
  static Index next(Index h) { return h + 1 - 3 * Index(h % 3 == 2); }
  static Index prev(Index h) { return h - 1 + 3 * Index(h % 3 == 0); }
  static Index triangle(Index h) { return h / 3; }

  Index origin(Index h) const { return origin_[h]; }
  Index dest(Index h) const { return origin_[next(h)]; }
  Index apex(Index h) const { return origin_[prev(h)]; }
  Index twin(Index h) const { return twin_[h]; }
  Index out(Index v) const { return out_[v]; }
  bool alive_triangle(Index t) const { return origin_[3 * t] != kNone; }
  bool alive_vertex(Index v) const { return out_[v] != kNone; }
  bool on_border(Index v) const { return twin_[out_[v]] == kNone; }

  const Vec3& position(Index v) const { return position_[v]; }
  Vec3& position(Index v) { return position_[v]; }
  std::span<const Vec3> positions() const { return position_; }

  std::size_t vertex_slots() const { return position_.size(); }
  std::size_t triangle_slots() const { return origin_.size() / 3; }
  std::size_t triangle_count() const { return live_triangles_; }
  std::size_t halfedge_slots() const { return origin_.size(); }

  /// Hints for the cache: what is about to be asked of half-edge h, of vertex v. (Not inlined, gcc
  /// takes a function that only prefetches for one without effect, and drops the call.)
  [[gnu::always_inline]] void prefetch_halfedge(Index h) const {
    __builtin_prefetch(&origin_[h]);
    __builtin_prefetch(&twin_[h]);
  }
  [[gnu::always_inline]] void prefetch_vertex(Index v) const {
    __builtin_prefetch(&position_[v]);
    __builtin_prefetch(&out_[v]);
  }

  /// The next half-edge leaving the same vertex, counter-clockwise; kNone past the last of a border
  /// vertex's fan.
  Index rotate_ccw(Index h) const { return twin_[prev(h)]; }

  /// Calls f(h) for every half-edge that leaves v, counter-clockwise from out(v). For a border
  /// vertex the last neighbour has no outgoing half-edge: it is apex(last) (= origin(prev(last))).
  template <class F>
  void for_each_out(Index v, F&& f) const {
    const Index first = out_[v];
    Index h = first;
    do {
      f(h);
      h = rotate_ccw(h);
    } while (h != kNone && h != first);
  }

  /// The half-edge on the border that arrives at v: the one before out(v) along the border, so its
  /// origin is v's predecessor there, and dest(out(v)) its successor. REQUIRES: on_border(v).
  /// O(degree).
  Index border_in(Index v) const {
    Index last = out_[v];
    for (Index h = last; h != kNone; h = rotate_ccw(h)) last = h;
    return prev(last);
  }

  /// Calls f(w) for every neighbour w of v, counter-clockwise from dest(out(v)); on the border the
  /// last one is v's predecessor, which for_each_out does not reach.
  template <class F>
  void for_each_neighbour(Index v, F&& f) const {
    Index last = kNone;
    for_each_out(v, [&](Index h) {
      f(origin_[next(h)]);
      last = h;
    });
    if (twin_[prev(last)] == kNone) f(origin_[prev(last)]);
  }

  /// Number of edges at v.
  int degree(Index v) const {
    int n = 0;
    for_each_out(v, [&](Index) { ++n; });
    return n + on_border(v);
  }

  /// The half-edge from a to b; kNone when there is none: then the two have no edge, or one on the
  /// border that runs from b to a. O(degree of a).
  Index find(Index a, Index b) const {
    const Index first = out_[a];
    Index h = first;
    do {
      if (dest(h) == b) return h;
      h = rotate_ccw(h);
    } while (h != kNone && h != first);
    return kNone;
  }
  /// The half-edge from a to b, or else the one from b to a; kNone when the two have no edge.
  Index find_edge(Index a, Index b) const {
    const Index h = find(a, b);
    return h != kNone ? h : find(b, a);
  }

  /// What the collapse of edge h keeps of the triangles around v, one of its two ends: all but the
  /// one or two at h. Calls f(e) for the half-edge e that leaves v in each, counter-clockwise from
  /// out(v), until f returns false; false when it did. O(degree).
  template <class F>
  bool all_kept(Index v, Index h, F&& f) const {
    const Index t = triangle(h), u = twin_[h] == kNone ? t : triangle(twin_[h]);
    const Index first = out_[v];
    Index e = first;
    do {
      if (triangle(e) != t && triangle(e) != u && !f(e)) return false;
      e = rotate_ccw(e);
    } while (e != kNone && e != first);
    return true;
  }

  /// The surviving fan of the collapse of edge h: the triangles around both ends, first origin(h),
  /// then dest(h), that it keeps and whose corner at that end moves to the merged vertex. f as
  /// above: such a triangle becomes (merged vertex, dest(e), apex(e)).
  template <class F>
  bool all_kept(Index h, F&& f) const {
    return all_kept(origin(h), h, f) && all_kept(dest(h), h, f);
  }
  template <class F>
  void for_each_kept(Index h, F&& f) const {
    all_kept(h, [&](Index e) { return f(e), true; });
  }

  /// The link condition: collapsing edge h keeps the mesh a manifold with the same topology. True
  /// iff the two ends share exactly the apexes of the edge's triangles, and, if both ends are on
  /// the border, the edge is too. Never true for the last triangle.
  bool link_ok(Index h) const;

  /// Collapses edge h: origin(h) vanishes into dest(h), whose position is not changed; one triangle
  /// (border edge) or two go. REQUIRES: link_ok(h). Afterwards all half-edges that left origin(h)
  /// and survive leave dest(h). Returns the surviving vertex.
  Index collapse(Index h);

  /// Replaces the diagonal h of its two triangles by the other one. REQUIRES: a twin; the caller
  /// checks that the quadrilateral is convex. Returns h, which now runs from the one old apex to
  /// the other: origin(h) = old apex of twin(h), dest(h) = old apex of h. Triangle slots stay.
  Index flip(Index h);

  /// Appends vertex p inside triangle t (1 -> 3). The first new triangle reuses slot t. Returns it.
  Index split_triangle(Index t, const Vec3& p);

  /// Appends vertex p on edge h (2 -> 4, on the border 1 -> 2). Returns the new vertex.
  Index split_edge(Index h, const Vec3& p);

  /// The plain arrays, vertices and triangles in slot order without the removed ones;
  /// deterministic. `new_index`, if given, receives for each vertex slot its index in the result,
  /// or kNone.
  Tin to_tin(std::vector<Index>* new_index = nullptr) const;

  /// Every invariant of the header's first paragraph; for tests and fuzzers. Empty when all hold.
  std::string check() const;

 private:
  std::vector<Vec3> position_;
  std::vector<Index> origin_, twin_;  // 3 per triangle slot
  std::vector<Index> out_;            // per vertex slot
  std::size_t live_triangles_ = 0;

  Index add_triangle(Index a, Index b, Index c);
  void link(Index h, Index g);
  void remove_triangle(Index t);
};

}  // namespace tind
