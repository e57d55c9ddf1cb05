#pragma once
// Whole numbers for the coordinates of a surface in space, as the .tpm stream wants them.

#include <optional>
#include <span>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// Each coordinate is (origin + X) / per_unit, X whole. With per_unit a power of ten or two, what
/// was written in decimals or in floats comes back to the last bit.
struct SpaceLattice {
  double per_unit = 1;
  Vec3 origin;  // whole numbers

  Vec3 whole(const Vec3& p) const;  // the X nearest to p
  Vec3 place(const Vec3& x) const;  // where X lies
  Vec3 snap(const Vec3& p) const { return place(whole(p)); }
  /// No place is farther than this from the lattice.
  double rounding() const { return 0.8660254037844387 / per_unit; }
};

/// The coarsest lattice of decimals (up to nine) or of binary fractions on which every vertex lies
/// exactly and which can number the box around them. None if there is none.
std::optional<SpaceLattice> exact_lattice(std::span<const Tin* const> meshes);

/// The finest lattice of binary fractions that can number the box. REQUIRES: finite coordinates.
SpaceLattice finest_lattice(std::span<const Tin* const> meshes);

/// For the way between two models: on which both are exact if there is such a lattice, with a
/// millionth of the box's diagonal, at most, for the places on the way; else the finest.
SpaceLattice lattice_between(std::span<const Tin* const> meshes);

/// With this step. Fails (invalid_argument) when it makes no sense for a mesh of this size.
Result<SpaceLattice> lattice_of_step(std::span<const Tin* const> meshes, double step);

/// The diagonal of the box around a mesh; 0 without vertices.
double diagonal_of(const Tin&);

}  // namespace tind
