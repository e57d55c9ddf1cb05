#pragma once
// The bodies of POST /plan and POST /tiles: JSON from anybody, checked.

#include <string_view>
#include <vector>

#include "terrain/pyramid/flight_plan.h"

namespace tind::api {

struct FlightRequest {
  std::vector<FlightFix> flight;
  FlightOptions options;
  double tile_bytes = 12000;  // what a tile is taken to be whose size is not known yet
};

inline constexpr std::size_t kMostFixes = 10000, kMostTiles = 256;

/// {"trajectory": [{"lon", "lat", "height_m", "time_s"}, ...]} or {"position": {"lon", "lat",
/// "height_m"}, "velocity": {"east", "north", "up"}, "horizon_s"}; options are optional. The error
/// (invalid_argument) names what is wrong; what is not known is an error, too.
Result<FlightRequest> parse_flight_request(std::string_view body);

/// {"tiles": ["12/656/1557", ...]}: at least one, at most kMostTiles, of the pyramid.
Result<std::vector<TileId>> parse_tile_list(std::string_view body);

}  // namespace tind::api
