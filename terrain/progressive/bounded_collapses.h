#pragma once
// The collapses that go with `bounded`: of the fine mesh that it makes for an error, on a lattice,
// and then always the collapse whose exact error over the posts is least, heights floating.
//
// `bounded` itself reaches one error and has no order of its own (a sweep takes every collapse that
// stays within the band), so the collapses from there on are ordered by what it promises: the
// largest error over all posts, at the height that makes it least.

#include "terrain/simplify/simplify.h"

namespace tind {

/// As simplify() with options.recorder set. The fine end is `bounded` at stop.max_error_m (or the
/// count), or with ratio 1 the full grid. The fine mesh may miss the error by what the lattice
/// costs where no height on it does better: the caller measures.
Result<Simplified> record_bounded_collapses(const HeightGrid&, double spacing_x_m,
                                            double spacing_y_m, const SimplifyOptions&,
                                            const Progress&);

}  // namespace tind
