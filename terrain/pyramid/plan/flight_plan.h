#pragma once
// Which tiles a flight will need, and when: so that they can be sent before they are.
//
// The rule of level selection is that of globe clients: a tile of level z is refined while its
// error on screen, level_error(z) * height_px / (2 tan(fov / 2) * distance), is above the
// tolerance. So a tile is needed from the moment its parent is refined, roots from the start, and
// none before its parent. Distances are to the tile's rectangle at the height of its highest ground
// (or nothing, below that), in every direction: a pilot may look anywhere. Of a tile that does not
// say how high it is that is its parent's, of the roots the flight's `ground_m`.
//
// The order is earliest deadline first, which is optimal for one link: if any order is in time,
// this one is [Jackson55]. `lead_s` says how long before the first fix the transfer must begin
// so that no tile is late; the first view alone makes it positive.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/tile_set.h"

namespace tind {

/// Where the camera is at a time; straight (in degrees) to the next.
struct FlightFix {
  Geographic where;
  double height_m = 0;  // above the ellipsoid
  double time_s = 0;
};

struct FlightOptions {
  double link_bits_per_s = 10e6;
  double tolerance_px = 2, viewport_height_px = 1080, fov_deg = 60;  // vertical
  std::size_t max_tiles = 20000;
  double ground_m = 0;  // above the ellipsoid
};

/// What is known of a tile before it is sent.
struct PlanFacts {
  std::size_t bytes = 0;                 // how large it is, or is taken to be
  std::optional<double> highest_m = {};  // of its ground, above the ellipsoid
};
/// Those of a tile that is there, as its header has them.
PlanFacts facts_of_tile(std::span<const std::uint8_t> quantized_mesh);

struct PlannedTile {
  TileId id;
  double needed_s = 0;   // of the flight's clock; early by at most one step of 1 s or 1/1000
  double arrives_s = 0;  // after the transfer has begun
  std::size_t bytes = 0;
};

struct FlightPlan {
  std::vector<PlannedTile> tiles;  // in the order of sending
  std::size_t bytes = 0;
  double lead_s = 0;      // at least 0
  std::size_t looks = 0;  // distances from cameras to tiles that it took
};

/// From here at this velocity (metres a second) for `horizon_s`: along a straight line in longitude
/// and latitude, which ends at a pole. Fails (invalid_argument) where that leads halfway around the
/// earth or further, as it does beside a pole, or away from it. REQUIRES: `from` is on earth.
Result<std::vector<FlightFix>> straight_flight(const FlightFix& from, double east, double north,
                                               double up, double horizon_s);

/// Places along the flight, at most some thousand and its fixes: for asking how high the ground is.
std::vector<Geographic> places_of(std::span<const FlightFix>);

/// `facts_of` is asked once for each tile that is needed, parents first; where it fails, so does
/// this. Fails (invalid_argument)
/// on a trajectory that is empty, leaves the earth or goes back in time; out_of_range beyond
/// max_tiles. Errc::cancelled on a stop. O(tiles x log steps); 1000 steps, and one for each fix.
Result<FlightPlan> plan_flight(const TileSet&, std::span<const FlightFix>, const FlightOptions&,
                               const std::function<Result<PlanFacts>(TileId)>& facts_of,
                               std::stop_token = {});

}  // namespace tind
