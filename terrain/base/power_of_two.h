#pragma once
// Steps, lattices and numbers of cells are powers of two, so that what lies on a coarse one lies on
// every finer one, and floats hold their multiples exactly.

#include <cmath>

namespace tind {

/// REQUIRES: x > 0.
inline double power_of_two_at_most(double x) { return std::exp2(std::floor(std::log2(x))); }
inline double power_of_two_at_least(double x) { return std::exp2(std::ceil(std::log2(x))); }

}  // namespace tind
