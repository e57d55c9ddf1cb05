#pragma once
// The triangles of a mesh by the boxes around them, seen from above: for whoever asks which may
// touch a place or a rectangle, however unevenly they are spread.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

/// A closed rectangle of the plane.
struct PlaneBox {
  Vec2 low, high;

  bool meets(const PlaneBox& o) const {
    return low.x <= o.high.x && o.low.x <= high.x && low.y <= o.high.y && o.low.y <= high.y;
  }
};

PlaneBox box_of(const Tin&, const Triangle&);

class TriangleTree {
 public:
  /// Keeps a reference to the mesh. O(n log n); 40 bytes a triangle.
  explicit TriangleTree(const Tin&);

  /// Calls f(triangle) for each whose box meets `box`, until f returns false; false when it did.
  /// O(sqrt(n) + found) typically.
  template <class F>
  bool each_near(const PlaneBox& box, F&& f) const;

 private:
  /// Children of node i are 2 i + 1 and 2 i + 2; those of the last level are runs of `order_`.
  const Tin& tin_;
  int levels_ = 0;
  std::vector<PlaneBox> nodes_;
  std::vector<std::uint32_t> order_;

  void build(std::size_t node, std::size_t begin, std::size_t end, int level);
  template <class F>
  bool visit(std::size_t node, std::size_t begin, std::size_t end, int level, const PlaneBox& box,
             F& f) const;
};

template <class F>
bool TriangleTree::each_near(const PlaneBox& box, F&& f) const {
  return visit(0, 0, order_.size(), 0, box, f);
}

template <class F>
bool TriangleTree::visit(std::size_t node, std::size_t begin, std::size_t end, int level,
                         const PlaneBox& box, F& f) const {
  if (begin == end || !nodes_[node].meets(box)) return true;
  if (level == levels_) {
    for (std::size_t i = begin; i < end; ++i)
      if (box_of(tin_, tin_.triangles[order_[i]]).meets(box) && !f(order_[i])) return false;
    return true;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  return visit(2 * node + 1, begin, middle, level + 1, box, f) &&
         visit(2 * node + 2, middle, end, level + 1, box, f);
}

}  // namespace tind
