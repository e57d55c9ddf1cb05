#pragma once
// A decoded tile as a surface: how far it is from a post. The checker's own way to find the
// triangle under a place; it shares nothing with the scans that fit and measure tiles when they are
// made.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/pyramid/check_decode.h"

namespace tind {

class TileSurface {
 public:
  /// REQUIRES: triangles name vertices that are there.
  explicit TileSurface(const CheckedTile&);

  std::size_t bytes() const;

  /// Height of the mesh minus z.
  struct Gap {
    double low = 0, high = 0;
    /// The one that is farther from 0.
    double worst() const { return high > -low ? high : low; }
  };
  /// Over all triangles that hold (u, v), the closed ones: on a common edge more than one. Nothing
  /// when none does.
  std::optional<Gap> gap_at(double u, double v, double z) const;

 private:
  int cell_of(double x) const;
  template <class Visit>
  void each_cell(std::uint32_t triangle, Visit&&) const;
  void sort_into_cells();
  std::optional<double> height_in(const std::array<std::uint32_t, 3>&, double u, double v) const;

  std::vector<Vec3> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  int cells_ = 1;
  std::vector<std::uint32_t> begin_, entries_;
};

}  // namespace tind
