#pragma once
// Rectangles on the globe taken together: the box around them and the place to look at first, also
// across the antimeridian, where neither is in the middle of -180..180.

#include <span>

#include "terrain/geo/coordinates.h"

namespace tind {

/// The box around all, the shorter way around the earth: of the gaps between them the widest is
/// left out. West lies within -180..180; a box across the antimeridian counts on beyond 180, as in
/// 179..181. REQUIRES: rectangles within -180..180, at least one.
GeoRect box_around(std::span<const GeoRect>);

/// With all that is within so many metres of it; near a pole all longitudes. May reach beyond 180
/// degrees and beyond a pole.
GeoRect grown(const GeoRect&, double metres);

/// The middle of the box where one of them is, else of the largest; longitude in -180..180.
Geographic place_in(std::span<const GeoRect>);

}  // namespace tind
