#include "server/api/flights/flight_request.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "server/api/tiles/tile_address.h"

namespace tind::api {
namespace {

using Need = Members::Need;

// Each fix is an object of four numbers; what else there can be are a few dozen.
constexpr std::size_t kMostFlightValues = 5 * kMostFixes + 100, kMostListValues = kMostTiles + 100;

void read_place(Members& members, FlightFix& fix) {
  members.number("lon", -360, 360, fix.where.lon, Need::must);
  members.number("lat", -90, 90, fix.where.lat, Need::must);
  members.number("height_m", -1e8, 1e8, fix.height_m, Need::must);
}

void read_trajectory(const Json& list, FlightRequest& out, Problems& problems) {
  if (!list.is_array() || list.empty() || list.size() > kMostFixes)
    return problems.add("trajectory",
                        "must be a list of 1 to " + std::to_string(kMostFixes) + " fixes");
  for (std::size_t i = 0; i < list.size() && problems.empty(); ++i) {
    FlightFix fix;
    Members members(list[i], "trajectory[" + std::to_string(i) + "]", problems);
    read_place(members, fix);
    members.number("time_s", -1e11, 1e11, fix.time_s, Need::must);
    members.nothing_else();
    if (i > 0 && fix.time_s < out.flight.back().time_s)
      problems.add(members.name_of("time_s"), "must not be before the fix before it");
    out.flight.push_back(fix);
  }
}

void read_straight(Members& members, FlightRequest& out, Problems& problems) {
  FlightFix from;
  double east = 0, north = 0, up = 0, horizon = 0;
  const Json* const position = members.member("position");
  if (!position)
    return problems.add("position", "missing: either a trajectory, or position and horizon_s");
  Members place(*position, "position", problems);
  read_place(place, from);
  place.nothing_else();
  if (const Json* const velocity = members.member("velocity")) {
    Members speed(*velocity, "velocity", problems);
    speed.number("east", -1e5, 1e5, east);
    speed.number("north", -1e5, 1e5, north);
    speed.number("up", -1e5, 1e5, up);
    speed.nothing_else();
  }
  members.number("horizon_s", 0, 86400, horizon, Need::must);
  if (!problems.empty()) return;
  auto flight = straight_flight(from, east, north, up, horizon);
  if (!flight) return problems.add("velocity", flight.error().what);
  out.flight = std::move(*flight);
}

std::optional<TileId> tile_of(const Json& json) {
  if (!json.is_string()) return {};
  const std::string_view text = json.get_ref<const std::string&>();
  const auto first = text.find('/'), last = text.rfind('/');
  if (first == text.npos || last == first) return {};
  return tile_address(text.substr(0, first), text.substr(first + 1, last - first - 1),
                      text.substr(last + 1));
}

}  // namespace

FlightRequest parse_flight_request(std::string_view body, Problems& problems) {
  FlightRequest out;
  const Json json = parse_body(body, kMostFlightValues, problems);
  if (!problems.empty()) return out;
  Members members(json, "", problems);
  FlightOptions& o = out.options;
  members.number("link_bits_per_s", 1, 1e15, o.link_bits_per_s);
  members.number("tolerance_px", 0.001, 1e6, o.tolerance_px);
  members.number("viewport_height_px", 1, 1e6, o.viewport_height_px);
  members.number("fov_deg", 0.01, 179, o.fov_deg);
  members.number("tile_bytes", 1, 1e9, out.tile_bytes);
  if (members.member("ground_m")) members.number("ground_m", -1e5, 1e5, out.ground_m.emplace());
  if (const Json* const list = members.member("trajectory"))
    read_trajectory(*list, out, problems);
  else
    read_straight(members, out, problems);
  members.nothing_else();
  return out;
}

std::vector<TileId> parse_tile_list(std::string_view body, Problems& problems) {
  std::vector<TileId> out;
  const Json json = parse_body(body, kMostListValues, problems);
  if (!problems.empty()) return out;
  Members members(json, "", problems);
  const Json* const list = members.member("tiles", Need::must);
  members.nothing_else();
  if (!list) return out;
  if (!list->is_array() || list->empty() || list->size() > kMostTiles) {
    problems.add("tiles", "must be a list of 1 to " + std::to_string(kMostTiles) + " addresses");
    return out;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto id = tile_of((*list)[i]);
    if (!id) {
      problems.add("tiles[" + std::to_string(i) + "]", "is not \"z/x/y\" of the pyramid");
      return out;
    }
    out.push_back(*id);
  }
  return out;
}

}  // namespace tind::api
