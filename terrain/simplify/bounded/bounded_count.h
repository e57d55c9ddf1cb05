#pragma once
// `bounded` with a triangle count: the smallest root mean square error over all samples. No sample
// is farther off than greedy insertion leaves it with as many triangles.
//
// Quadrics rate a collapse by the planes of triangles that no longer exist. Here it is rated by the
// samples themselves: by the sum of their squared errors in the star that it leaves. With n
// triangles over N samples a star holds about 5 N / n samples. So this is cheap if one does not
// start from the full mesh, but from an insertion of a few times n triangles.
// COST: about that of qem (docs/methods.md has the figures); one thread.

#include <cstddef>
#include <cstdint>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/simplify/common/samples.h"

namespace tind {

struct CountOptions {
  std::size_t triangles = 2;  // at most so many are left
  double x_scale = 1;         // metric length of an x unit over that of a y unit (Delaunay test)
  double surplus = 1.8;       // insertion goes to so many times `triangles`
  bool any_place = false;     // samples lie anywhere (InsertionOptions)
  int rounds = 3;             // of fitting vertices and flipping edges at the end
};

struct CountResult {
  Tin tin;
  std::uint64_t collapses = 0;
  double max_error_m = 0;  // no valid sample is farther from the mesh (except for rounding)
};

/// `start` covers all of `samples`, whose neighbours are about 1 apart, with triangles that leave
/// no more than CountOptions::triangles; what of its border lies on the rectangle around it may
/// thin out along that. Fails only when stopped (cancelled).
template <class Samples>
Result<CountResult> fit_to_count(const Tin& start, const Samples& samples, const CountOptions&,
                                 const Progress& progress = {});

}  // namespace tind
