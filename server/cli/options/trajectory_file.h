#pragma once
// A flight as a file: CSV or GeoJSON from anybody, checked.

#include <optional>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/pyramid/plan/flight_plan.h"

namespace tind::cli {

/// Fixes in the order of the file; degrees, metres above the ellipsoid, seconds.
///
/// CSV: a header that names lon, lat, height and time in any order (also longitude, x, latitude, y,
/// height_m, altitude, alt, z, time_s, t; others are passed over), or no header and these four.
/// GeoJSON: a LineString of [lon, lat, height], or [lon, lat, height, time], alone, as a Feature or
/// as the only one of a FeatureCollection; times also as the property "times" or "coordTimes".
///
/// A time is seconds, or a date like 2026-01-31T12:00:00Z, from which the first one is taken off.
/// Where there are none, `speed` (metres a second) makes them; a missing height is 0 only in files
/// that have no column of heights. Fails (invalid_argument), naming line or fix.
Result<std::vector<FlightFix>> parse_trajectory(std::string_view text, std::optional<double> speed);

}  // namespace tind::cli
