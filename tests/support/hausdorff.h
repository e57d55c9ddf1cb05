#pragma once
// The Hausdorff distance of two surfaces as CGAL bounds it: what our sampled one is held against.

#include <optional>

#include "terrain/mesh/tin.h"

namespace tind::test {

/// From a to b: at most `bound` off. Nothing where the tests were built without CGAL.
/// REQUIRES: manifold meshes with at least one triangle each.
std::optional<double> bounded_hausdorff(const Tin& a, const Tin& b, double bound);

}  // namespace tind::test
