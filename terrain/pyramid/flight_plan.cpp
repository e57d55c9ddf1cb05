// The flight is walked in steps; at each the tree of tiles is descended as a client would, with the
// length of the step added to its reach, so that nothing that is needed during the step is missed.

#include "terrain/pyramid/flight_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "terrain/geo/ellipsoid.h"

namespace tind {

namespace {

constexpr double kRadian = std::numbers::pi / 180;

double longitude_difference(double a, double b) { return std::remainder(a - b, 360); }

/// From the camera to the nearest point of the tile's rectangle, at sea level.
double distance(const FlightFix& camera, TileId tile) {
  const GeoRect r = tiling::rect(tile);
  const double middle = (r.west + r.east) / 2;
  const double off = std::abs(longitude_difference(camera.where.lon, middle));
  const double lon = std::max(0.0, off - r.width() / 2);
  const double lat = std::max({0.0, r.south - camera.where.lat, camera.where.lat - r.north});
  // Meridians come closer towards the poles: the shorter of both ends, never too far.
  const double nearest = std::clamp(camera.where.lat, r.south, r.north);
  const double scale = std::min(std::cos(nearest * kRadian), std::cos(camera.where.lat * kRadian));
  const double metres = wgs84::metres_per_degree(0).y;
  return std::hypot(lon * metres * std::max(0.0, scale), lat * metres,
                    std::max(0.0, camera.height_m));
}

Result<void> check(std::span<const FlightFix> flight, const FlightOptions& o) {
  if (flight.empty()) return fail(Errc::invalid_argument, "the trajectory is empty");
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const FlightFix& f = flight[i];
    const bool on_earth = std::abs(f.where.lon) <= 360 && std::abs(f.where.lat) <= 90 &&
                          std::abs(f.height_m) <= 1e8 && std::abs(f.time_s) <= 1e9;
    if (!on_earth)
      return fail(Errc::invalid_argument,
                  "fix " + std::to_string(i) + " of the trajectory is not on earth");
    if (i > 0 && !(f.time_s >= flight[i - 1].time_s))
      return fail(Errc::invalid_argument,
                  "fix " + std::to_string(i) + " of the trajectory goes back in time");
  }
  if (!(o.link_bits_per_s > 0) || !(o.tolerance_px > 0) || !(o.viewport_height_px > 0) ||
      !(o.fov_deg > 0 && o.fov_deg < 180))
    return fail(Errc::invalid_argument,
                "link speed, tolerance and viewport must be positive, the field of view below 180");
  return {};
}

FlightFix between(const FlightFix& a, const FlightFix& b, double s) {
  FlightFix f;
  f.where.lon = a.where.lon + s * longitude_difference(b.where.lon, a.where.lon);
  f.where.lat = a.where.lat + s * (b.where.lat - a.where.lat);
  f.height_m = a.height_m + s * (b.height_m - a.height_m);
  f.time_s = a.time_s + s * (b.time_s - a.time_s);
  return f;
}

double path_length(const FlightFix& a, const FlightFix& b) {
  const double metres = wgs84::metres_per_degree(0).y;
  return std::hypot(longitude_difference(a.where.lon, b.where.lon) * metres,
                    (a.where.lat - b.where.lat) * metres, a.height_m - b.height_m);
}

class Planner {
 public:
  Planner(const TileSet& tiles, const FlightOptions& o) : tiles_(tiles), options_(o) {
    reach_ = o.viewport_height_px / (2 * std::tan(o.fov_deg / 2 * kRadian) * o.tolerance_px);
  }

  /// What is needed from `camera` or from anywhere `slack` metres around it. False: too many tiles.
  bool look(const FlightFix& camera, double slack) {
    for (std::uint32_t x = 0; x < tiling::columns(0); ++x)
      need(*tiling::tile(0, x, 0), camera, slack);
    return first_.size() <= options_.max_tiles;
  }
  const std::map<TileId, double>& first() const { return first_; }

 private:
  const TileSet& tiles_;
  const FlightOptions& options_;
  double reach_;
  std::map<TileId, double> first_;

  void need(TileId tile, const FlightFix& camera, double slack) {
    if (!tiles_.available(tile) || first_.size() > options_.max_tiles) return;
    first_.try_emplace(tile, camera.time_s);
    if (tile.level >= tiles_.layer().maxzoom) return;
    if (distance(camera, tile) - slack >= tiling::level_error(tile.level) * reach_) return;
    for (int north = 0; north < 2; ++north)
      for (int east = 0; east < 2; ++east) need(tile.child(east, north), camera, slack);
  }
};

}  // namespace

std::vector<FlightFix> straight_flight(const FlightFix& from, double east, double north, double up,
                                       double horizon_s) {
  const Vec2 degree = wgs84::metres_per_degree(from.where.lat);
  FlightFix to = from;
  to.where.lon += east * horizon_s / std::max(degree.x, 1.0);
  to.where.lat = std::clamp(to.where.lat + north * horizon_s / degree.y, -90.0, 90.0);
  to.height_m += up * horizon_s;
  to.time_s += horizon_s;
  return {from, to};
}

Result<FlightPlan> plan_flight(const TileSet& tiles, std::span<const FlightFix> flight,
                               const FlightOptions& o,
                               const std::function<std::size_t(TileId)>& bytes_of) {
  if (const auto ok = check(flight, o); !ok) return std::unexpected(ok.error());
  const double total = flight.back().time_s - flight.front().time_s;
  const double step = std::max(1.0, total / 1000);
  Planner planner(tiles, o);
  bool fits = planner.look(flight.front(), 0);
  for (std::size_t i = 0; i + 1 < flight.size() && fits; ++i) {
    const FlightFix &a = flight[i], &b = flight[i + 1];
    const int steps = std::max(1, int(std::ceil((b.time_s - a.time_s) / step)));
    for (int k = 0; k < steps && fits; ++k) {
      const FlightFix from = between(a, b, double(k) / steps);
      fits = planner.look(from, path_length(from, between(a, b, double(k + 1) / steps)));
    }
  }
  if (!fits)
    return fail(Errc::out_of_range, "the flight needs more than " + std::to_string(o.max_tiles) +
                                        " tiles; plan a shorter one, or with a larger tolerance");
  FlightPlan plan;
  for (const auto& [id, time] : planner.first()) plan.tiles.push_back({id, time, 0, bytes_of(id)});
  // The map is in the order of levels: among equals parents come first.
  std::ranges::stable_sort(plan.tiles, {}, &PlannedTile::needed_s);
  for (PlannedTile& t : plan.tiles) {
    plan.bytes += t.bytes;
    t.arrives_s = 8 * double(plan.bytes) / o.link_bits_per_s;
    plan.lead_s = std::max(plan.lead_s, t.arrives_s - (t.needed_s - flight.front().time_s));
  }
  return plan;
}

}  // namespace tind
