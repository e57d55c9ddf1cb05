#pragma once
// The nearest point of a triangle mesh: a binary tree of boxes over its triangles, with slabs
// where boxes are much larger than the long triangles in them (k-DOPs, [Klosowski98], of the
// directions that help); cells of space where no boxes around triangles help.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "terrain/mesh/tin.h"
#include "terrain/mesh/triangle_cells.h"

namespace tind {

struct NearestPoint {
  double squared = 0;  // distance
  std::uint32_t triangle = 0;
  Vec3 weights;                 // barycentric, of the triangle's three corners
  std::uint32_t looked_at = 0;  // triangles; what the search cost
};

class NearestTriangle {
 public:
  /// Keeps a reference to the mesh. REQUIRES: at least one triangle. O(n log n).
  explicit NearestTriangle(const Tin&);

  /// `hint`: a triangle that is probably near (the last answer); any will do. O(log n) typically.
  NearestPoint find(const Vec3& p, std::uint32_t hint = 0) const;

  /// Those among which it looks: of triangles in one place the first.
  std::size_t distinct() const { return order_.size(); }

 private:
  /// What lies between two planes.
  struct Slab {
    Vec3 direction;  // of length 1
    double middle = 0, half = 0;
  };
  using Slabs = std::array<Slab, 2>;
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);
  struct Box {
    Vec3 low, high;
    std::uint32_t slabs = kNone;  // in slabs_
  };
  /// Children of node i are 2 i + 1 and 2 i + 2; the last level holds runs of `order_`.
  const Tin& tin_;
  std::vector<Box> nodes_;
  std::vector<Slabs> slabs_;
  std::vector<std::uint32_t> order_;
  std::optional<TriangleCells> cells_;  // of order_; where the boxes are no help
  std::vector<Slab> planes_;            // then also each triangle's own, as order_ has them
  int levels_ = 0;

  void add_slabs(Box&, std::size_t begin, std::size_t end);
  void add_planes();
  template <class Leaf>
  void search_boxes(const Vec3& p, const NearestPoint& best, Leaf) const;
  template <class Leaf>
  void search_cells(const Vec3& p, const NearestPoint& best, Leaf) const;
  double in_the_way() const;
  double away(const Box&, const Vec3& p) const;
  void build(std::size_t node, std::size_t begin, std::size_t end, int level,
             std::vector<Vec3>& centres);
};

}  // namespace tind
