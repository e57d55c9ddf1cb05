#pragma once
// One mesh of a multi-triangulation: the set of nodes that are applied. It is refined and coarsened
// in place, and remembers what has changed since it was last asked.

#include <cstdint>
#include <vector>

#include "terrain/progressive/multires/multi_triangulation.h"

namespace tind {

/// What leads from one mesh to another; everything in ascending order. A triangle is known by its
/// number in the multi-triangulation, and so is a vertex.
struct FrontChange {
  std::vector<MultiTriangulation::Index> removed_triangles, added_triangles;
  std::vector<MultiTriangulation::Index> removed_vertices, added_vertices;
};

class Front {
 public:
  using Index = MultiTriangulation::Index;
  static constexpr Index kNone = MultiTriangulation::kNone;

  /// The base mesh. Borrows the multi-triangulation.
  explicit Front(const MultiTriangulation&);

  bool applied(Index node) const { return bits_[node / 64] >> (node % 64) & 1; }
  /// Among the triangles of the mesh? O(log nodes).
  bool active(Index triangle) const;
  bool split(Index triangle) const {
    const Index n = all_.splitter(triangle);
    return n != kNone && applied(n);
  }

  /// Applies a node and whatever it needs; `applied_now(node)` is called for each, ancestors first.
  template <class F>
  void apply(Index node, F&& applied_now);

  /// True when none of the node's fine triangles is split: then it can be taken back.
  bool leaf(Index node) const;
  /// REQUIRES: applied(node) and leaf(node).
  void take_back(Index node) { toggle(node); }

  std::size_t triangle_count() const { return triangles_; }
  std::vector<Index> active_triangles() const;
  /// The mesh; vertices in the order of their numbers.
  Tin to_tin() const;

  /// Since the last call, or since the base mesh was made (what the base holds is in no change).
  FrontChange take_change();

  std::size_t memory_bytes() const {
    return 16 * bits_.capacity() + 4 * (touched_.capacity() + stack_.capacity());
  }

 private:
  void toggle(Index node);

  const MultiTriangulation& all_;
  std::vector<std::uint64_t> bits_, changed_;  // one a node
  std::vector<Index> touched_, stack_;
  std::size_t triangles_;
};

template <class F>
void Front::apply(Index node, F&& applied_now) {
  stack_.assign(1, node);
  while (!stack_.empty()) {
    const Index n = stack_.back();
    const std::size_t before = stack_.size();
    if (!applied(n)) {
      for (Index i = all_.coarse_begin(n); i < all_.coarse_end(n); ++i) {
        const Index maker = all_.coarse(i).maker;
        if (maker != kNone && !applied(maker)) stack_.push_back(maker);
      }
    }
    if (stack_.size() > before) continue;  // the parents first
    stack_.pop_back();
    if (applied(n)) continue;
    toggle(n);
    applied_now(n);
  }
}

}  // namespace tind
