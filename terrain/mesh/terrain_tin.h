#pragma once
// Is a mesh that somebody made terrain: heights over a plane? What terrain methods start from where
// there is no raster.

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// The mesh as terrain: its shape without attributes; vertices that only these kept apart welded,
/// unused ones gone; every triangle counter-clockwise seen from above, whichever way its file runs
/// around it; a manifold, in which fans that meet in one vertex have one each. Positions stay to
/// the bit.
///
/// Fails (bad_data), in one line that names a place, where it is no terrain: a triangle without
/// area seen from above (a vertical face), or triangles one above another (an overhang, a bridge,
/// the underside of a solid); or without any triangle. REQUIRES: finite coordinates, valid indices.
/// O(n log n).
Result<Tin> as_terrain(Tin);

}  // namespace tind
