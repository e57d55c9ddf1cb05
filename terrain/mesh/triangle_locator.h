#pragma once
// Which triangle of a mesh lies over a place.

#include <cstdint>
#include <optional>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// Triangles by the squares of a grid that they may touch. Building it is O(triangles), in
/// memory too, a question O(1) on average, more where triangles are long. Refers to the mesh.
class TriangleLocator {
 public:
  explicit TriangleLocator(const Tin&);

  /// The mesh's height there; where triangles meet, that of the first of them. Nothing where none
  /// covers the place: one that misses an edge by rounding lies on it.
  std::optional<double> height_at(Vec2) const;

 private:
  const Tin* mesh_;
  Vec2 low_{}, squares_per_unit_{};
  int side_ = 1;
  std::vector<std::uint32_t> first_;  // by square, into list_; one more at the end
  std::vector<std::uint32_t> list_;   // triangles

  int square(double x, double low, double per_unit) const;
};

}  // namespace tind
