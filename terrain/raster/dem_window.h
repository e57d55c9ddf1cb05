#pragma once
// A rectangle of a DEM's posts as a DEM of its own: what analysts mean by "this area".

#include <memory>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// The smallest rectangle of posts with an outline on the globe inside: its places, close enough
/// together that the way from each to the next is straight to a post. A place within a millionth of
/// a post's counts as the post's. Of a source that goes around the globe, columns may be beyond its
/// first or last, as read() takes them. Cut off where the DEM ends; fails (out_of_range) where
/// nothing is left, and (invalid_argument) without a CRS.
Result<PostRect> posts_around(const DemSource&, std::span<const Geographic> outline);

/// A rectangle in degrees as an outline, `east` beyond 180 where it crosses the antimeridian.
std::vector<Geographic> outline_of(const GeoRect&);

/// Those posts, the first of them at column and row 0. Shares the source; reads no post. Bounds are
/// those of the posts on its rim.
std::shared_ptr<const DemSource> dem_window(std::shared_ptr<const DemSource>, const PostRect&);

}  // namespace tind
