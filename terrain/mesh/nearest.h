#pragma once
// The nearest point of a triangle mesh: a binary tree of boxes over its triangles.

#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

struct NearestPoint {
  double squared = 0;  // distance
  std::uint32_t triangle = 0;
  Vec3 weights;  // barycentric, of the triangle's three corners
};

class NearestTriangle {
 public:
  /// Keeps a reference to the mesh. REQUIRES: at least one triangle. O(n log n).
  explicit NearestTriangle(const Tin&);

  /// `hint`: a triangle that is probably near (the last answer); any will do. O(log n) typically.
  NearestPoint find(const Vec3& p, std::uint32_t hint = 0) const;

 private:
  struct Box {
    Vec3 low, high;
  };
  /// Children of node i are 2 i + 1 and 2 i + 2; the last level holds runs of `order_`.
  const Tin& tin_;
  std::vector<Box> nodes_;
  std::vector<std::uint32_t> order_;
  int levels_ = 0;

  void build(std::size_t node, std::size_t begin, std::size_t end, int level,
             std::vector<Vec3>& centres);
};

}  // namespace tind
