#pragma once
// Colours that the vertices of a held mesh over a square are to show: on a lattice, bilinear
// between its nodes. Whose they are, and where on earth, it does not know.

#include <array>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

class HeldColours {
 public:
  using Colour = std::array<float, 3>;

  /// Over the square from (0, 0) to (extent, extent); nodes by row, x first. REQUIRES: (cells +
  /// 1)^2 of them.
  HeldColours(int cells, double extent, std::vector<Colour> nodes);

  Colour at(double x, double y) const;

  /// What a triangle shows wrongly: the sum, over the nodes in it and the three channels, of the
  /// squared difference between the node and what its corners' colours give there. REQUIRES:
  /// counter-clockwise. O(nodes in it).
  double error(const Vec3& a, const Vec3& b, const Vec3& c) const;

  double step() const { return step_; }

 private:
  int cells_;
  double step_;
  std::vector<Colour> nodes_;

  const Colour& node(int i, int j) const {
    return nodes_[std::size_t(j) * std::size_t(cells_ + 1) + std::size_t(i)];
  }
};

}  // namespace tind
