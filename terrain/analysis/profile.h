#pragma once
// Heights along a line: at equal distances, or as the surface itself has them.

#include <cstddef>
#include <span>
#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/geo/geodesic_path.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct ProfilePoint {
  double distance_m = 0;  // along the line, on the ellipsoid
  Geographic place;
  HeightAt height;
};

/// Of a DEM, H as height_at() has it.
struct Profile {
  double length_m = 0;
  std::vector<ProfilePoint> points;  // in their order along the line, both ends among them
};

inline constexpr std::size_t kMostProfilePoints = 1'000'000;

/// Distances for sampled_profile(): `count` (at least two) equal ones; or every `step_m` (above 0)
/// from the beginning, and the end.
std::vector<double> even_distances(double length_m, std::size_t count);
std::vector<double> stepped_distances(double length_m, double step_m);

/// After so many metres each. Fails with the source's errors, (invalid_argument) for a DEM without
/// CRS, (cancelled).
Result<Profile> sampled_profile(const DemSource&, const GeodesicPath&,
                                std::vector<double> distances, const std::stop_token& = {});

/// Everywhere where H along the line turns: where the line crosses a row or column of posts, and
/// the tops and bottoms between. Between two points that follow each other H rises or falls all the
/// way, along a parabola: a polyline through them has the lowest and the highest height of the
/// line, and no height between two of them lies outside of theirs. A stretch that is void or
/// outside is one point without height, in its middle, between its ends.
///
/// Exact for a line that lies within kProfileTolerance_posts of the geodesic. O(cells on the way).
/// Fails as above, and (out_of_range) for more than kMostProfilePoints.
Result<Profile> exact_profile(const DemSource&, const GeodesicPath&, const std::stop_token& = {});
inline constexpr double kProfileTolerance_posts = 1e-4;

}  // namespace tind
