#pragma once
// A decoded tile as a surface: how far it is from a post. The checker's own way to find the
// triangle under a place; it shares nothing with the scans that fit and measure tiles when they
// are made.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "terrain/check/check_decode.h"
#include "terrain/geo/coordinates.h"

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
  using Triangle = std::array<Vec3, 3>;

  struct Place {
    double u, v, side;
  };
  struct Square {
    std::uint32_t first = 0, count = 0;  // of entries_; or kDivided, and the first of four squares
  };
  static constexpr std::uint32_t kDivided = ~std::uint32_t(0);

  static bool reaches_into(const Triangle&, const Place&);
  void divide(std::size_t square, const Place&, const std::vector<std::uint32_t>& triangles,
              int depth);
  static std::optional<double> height_in(const Triangle&, double u, double v);

  std::vector<Triangle> triangles_;
  std::vector<Square> squares_;  // the first is the whole tile
  std::vector<std::uint32_t> entries_;
};

}  // namespace tind
