#pragma once
// The bodies of POST /plan and POST /tiles.

#include <string_view>
#include <vector>

#include "server/api/members.h"
#include "terrain/pyramid/plan/flight_plan.h"

namespace tind::api {

struct FlightRequest {
  std::vector<FlightFix> flight;
  FlightOptions options;
  double tile_bytes = 12000;            // what a tile is taken to be whose size is not known yet
  std::optional<double> ground_m = {};  // as FlightOptions has it
};

inline constexpr std::size_t kMostFixes = 10000, kMostTiles = 256;

/// {"trajectory": [{"lon", "lat", "height_m", "time_s"}, ...]} or {"position": {"lon", "lat",
/// "height_m"}, "velocity": {"east", "north", "up"}, "horizon_s"}; options are optional. Where
/// there are problems the result is not to be used.
FlightRequest parse_flight_request(std::string_view body, Problems&);

/// {"tiles": ["12/656/1557", ...]}: at least one, at most kMostTiles, of the pyramid.
std::vector<TileId> parse_tile_list(std::string_view body, Problems&);

}  // namespace tind::api
