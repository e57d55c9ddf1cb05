// The flight is cut into steps, each with a place and a slack, the length of the step, which is
// added to the client's reach so that nothing that is needed during the step is missed. The tree of
// tiles is descended once, and each tile that is needed asks which step is the first to refine it.
// Steps lie in a tree of boxes by place and slack, so that the answer takes a few boxes and not all
// steps, in whatever order the flight visits places: O(tiles x log steps).

#include "terrain/pyramid/plan/flight_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "proto/tile/quantized_mesh.h"
#include "terrain/base/bytes.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/progressive/multires/lod_selection.h"

namespace tind {

namespace {

constexpr double kRadian = std::numbers::pi / 180;
constexpr double kMostHeight = 1e8;       // metres
constexpr double kFarthestTime_s = 1e11;  // so that microseconds are left of doubles

double longitude_difference(double a, double b) { return std::remainder(a - b, 360); }

/// A tile as seen by the rule: it is refined from places nearer than `reach_m`.
struct Target {
  GeoRect rect;
  double middle = 0, half = 0;  // of its longitudes
  double reach_m = 0, highest_m = 0;
};

Target target_of(TileId tile, double reach_m, double highest_m) {
  const GeoRect rect = tiling::rect(tile);
  return {rect, (rect.west + rect.east) / 2, rect.width() / 2, reach_m, highest_m};
}

/// Cameras in a box of longitudes, latitudes and heights, or one.
struct Box {
  double lon = 0, lon_half = 0, south = 0, north = 0, height_m = 0;  // the lowest
  double slack_m = 0;                                                // the largest
};

/// From the nearest place of the box to the nearest point of the tile's rectangle, at the height of
/// its highest ground: no camera in the box is nearer. Of one camera the distance itself.
double distance(const Box& box, const Target& t) {
  const double off = std::abs(longitude_difference(box.lon, t.middle)) - box.lon_half;
  const double lon = std::max(0.0, off - t.half);
  const double lat = std::max({0.0, t.rect.south - box.north, box.south - t.rect.north});
  // Meridians come closer towards the poles: the shorter of both ends, never too far.
  const auto highest = [](double a, double b) { return std::max(std::abs(a), std::abs(b)); };
  const double nearest = highest(std::clamp(box.south, t.rect.south, t.rect.north),
                                 std::clamp(box.north, t.rect.south, t.rect.north));
  const double scale = std::cos(std::max(nearest, highest(box.south, box.north)) * kRadian);
  const double metres = wgs84::metres_per_degree(0).y;
  return std::hypot(lon * metres * std::max(0.0, scale), lat * metres,
                    std::max(0.0, box.height_m - t.highest_m));
}

/// May a camera of the box refine the tile?
bool refines(const Box& box, const Target& t) { return distance(box, t) - box.slack_m < t.reach_m; }

Result<void> check(std::span<const FlightFix> flight, const FlightOptions& o) {
  if (flight.empty()) return fail(Errc::invalid_argument, "the trajectory is empty");
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const FlightFix& f = flight[i];
    const bool on_earth = std::abs(f.where.lon) <= 360 && std::abs(f.where.lat) <= 90 &&
                          std::abs(f.height_m) <= kMostHeight;
    if (!on_earth)
      return fail(Errc::invalid_argument,
                  "fix " + std::to_string(i) + " of the trajectory is not on earth");
    if (!(std::abs(f.time_s) <= kFarthestTime_s))
      return fail(Errc::invalid_argument,
                  "the time of fix " + std::to_string(i) +
                      " of the trajectory is none: it is in seconds, at most 10^11");
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

struct Step {
  Box camera;  // one
  double time_s = 0;
};

/// One step for each second of the flight or each 1/1000 of it, and one for its first moment.
std::vector<Step> steps_of(std::span<const FlightFix> flight) {
  std::vector<Step> steps;
  const auto add = [&](const FlightFix& f, double slack_m) {
    steps.push_back(
        {{std::remainder(f.where.lon, 360), 0, f.where.lat, f.where.lat, f.height_m, slack_m},
         f.time_s});
  };
  add(flight.front(), 0);
  const double length = std::max(1.0, (flight.back().time_s - flight.front().time_s) / 1000);
  for (std::size_t i = 0; i + 1 < flight.size(); ++i) {
    const FlightFix &a = flight[i], &b = flight[i + 1];
    const int count = std::max(1, int(std::ceil((b.time_s - a.time_s) / length)));
    for (int k = 0; k < count; ++k) {
      const FlightFix from = between(a, b, double(k) / count);
      add(from, path_length(from, between(a, b, double(k + 1) / count)));
    }
  }
  return steps;
}

/// Steps by place and slack: a binary tree of boxes, cut in the middle of their longest side.
class StepTree {
 public:
  explicit StepTree(std::vector<Step> steps) : steps_(std::move(steps)), order_(steps_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    make(0, std::uint32_t(order_.size()));
  }
  double time_s(std::uint32_t step) const { return steps_[step].time_s; }
  std::size_t looks() const { return looks_; }

  /// The first step that refines all of these, from the root of tiles down to the one in question.
  std::optional<std::uint32_t> first(std::span<const Target> way) {
    std::uint32_t best = kNone;
    look(0, way, best);
    return best == kNone ? std::nullopt : std::optional(best);
  }

 private:
  static constexpr std::uint32_t kNone = ~0u, kLeaf = 8;
  struct Node {
    Box box;
    std::uint32_t earliest = 0;                 // step
    std::uint32_t begin = 0, end = 0;           // in order_
    std::uint32_t left = kNone, right = kNone;  // left has the earlier step
  };
  std::vector<Step> steps_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
  std::size_t looks_ = 0;

  std::uint32_t make(std::uint32_t begin, std::uint32_t end) {
    const auto at = std::uint32_t(nodes_.size());
    const std::span<std::uint32_t> mine(order_.data() + begin, order_.data() + end);
    struct Extent {
      double low = HUGE_VAL, high = -HUGE_VAL;
    };
    constexpr double kMetres = 111320;
    const auto side = [&](std::uint32_t step, std::size_t k) {  // metres
      const Box& c = steps_[step].camera;
      return std::array{c.lon * kMetres, c.south * kMetres, c.height_m, c.slack_m}[k];
    };
    std::array<Extent, 4> extent;
    Node node;
    node.begin = begin, node.end = end;
    node.earliest = *std::ranges::min_element(mine);
    for (const std::uint32_t step : mine)
      for (std::size_t k = 0; k < 4; ++k) {
        extent[k].low = std::min(extent[k].low, side(step, k));
        extent[k].high = std::max(extent[k].high, side(step, k));
      }
    node.box = {(extent[0].low + extent[0].high) / 2 / kMetres,
                (extent[0].high - extent[0].low) / 2 / kMetres * (1 + 1e-12),
                extent[1].low / kMetres,
                extent[1].high / kMetres,
                extent[2].low,
                extent[3].high};
    nodes_.push_back(node);
    if (end - begin <= kLeaf) {
      std::ranges::sort(mine);
      return at;
    }
    std::size_t longest = 0;
    for (std::size_t k = 1; k < 4; ++k)
      if (extent[k].high - extent[k].low > extent[longest].high - extent[longest].low) longest = k;
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::ranges::nth_element(mine, mine.begin() + (middle - begin), {}, [&](std::uint32_t step) {
      return std::pair(side(step, longest), step);
    });
    std::uint32_t left = make(begin, middle), right = make(middle, end);
    if (nodes_[right].earliest < nodes_[left].earliest) std::swap(left, right);
    nodes_[at].left = left, nodes_[at].right = right;
    return at;
  }

  void look(std::uint32_t at, std::span<const Target> way, std::uint32_t& best) {
    const Node& node = nodes_[at];
    if (node.earliest >= best) return;
    ++looks_;
    if (!refines(node.box, way.back())) return;
    if (node.left != kNone) {
      look(node.left, way, best);
      look(node.right, way, best);
      return;
    }
    for (std::uint32_t i = node.begin; i < node.end && order_[i] < best; ++i) {
      const Box& camera = steps_[order_[i]].camera;
      const auto of_camera = [&](const Target& t) { return ++looks_, refines(camera, t); };
      if (of_camera(way.back()) && std::ranges::all_of(way, of_camera)) best = order_[i];
    }
  }
};

class Planner {
 public:
  Planner(const TileSet& tiles, std::span<const FlightFix> flight, const FlightOptions& o,
          const std::function<Result<PlanFacts>(TileId)>& facts_of)
      : tiles_(tiles), options_(o), facts_of_(facts_of), steps_(steps_of(flight)) {
    reach_ = distance_per_error(o.viewport_height_px, o.fov_deg * kRadian, o.tolerance_px);
  }

  /// What is needed and from when on, in no order.
  Result<FlightPlan> run(const std::stop_token& stop) {
    stop_ = stop;
    for (std::uint32_t x = 0; x < tiling::columns(0); ++x)
      need(*tiling::tile(0, x, 0), steps_.time_s(0), options_.ground_m);
    if (stop_.stop_requested()) return fail(Errc::cancelled, "stopped while planning a flight");
    if (failed_) return std::unexpected(*failed_);
    if (too_many())
      return fail(Errc::out_of_range, "the flight needs more than " +
                                          std::to_string(options_.max_tiles) +
                                          " tiles; plan a shorter one, or with a larger tolerance");
    FlightPlan plan;
    plan.tiles = std::move(needed_);
    plan.looks = steps_.looks();
    return plan;
  }

 private:
  const TileSet& tiles_;
  const FlightOptions& options_;
  const std::function<Result<PlanFacts>(TileId)>& facts_of_;
  StepTree steps_;
  double reach_;
  std::stop_token stop_;
  std::vector<Target> way_;  // from the root to the tile that is looked at
  std::vector<PlannedTile> needed_;
  std::optional<Error> failed_;  // facts of a tile that could not be had

  bool ended() const { return failed_ || too_many() || stop_.stop_requested(); }
  bool too_many() const { return needed_.size() > options_.max_tiles; }

  /// `highest_m`: of the ground, where the tile does not say it.
  void need(TileId tile, double time_s, double highest_m) {
    if (!tiles_.available(tile) || ended()) return;
    const auto facts = facts_of_(tile);
    if (!facts) {
      failed_ = facts.error();
      return;
    }
    needed_.push_back({tile, time_s, 0, facts->bytes});
    if (tile.level >= tiles_.layer().maxzoom) return;
    highest_m = facts->highest_m.value_or(highest_m);
    way_.push_back(target_of(tile, tiling::level_error(tile.level) * reach_, highest_m));
    if (const auto first = steps_.first(way_)) {
      for (int north = 0; north < 2; ++north)
        for (int east = 0; east < 2; ++east)
          need(tile.child(east, north), steps_.time_s(*first), highest_m);
    }
    way_.pop_back();
  }
};

}  // namespace

Result<std::vector<FlightFix>> straight_flight(const FlightFix& from, double east, double north,
                                               double up, double horizon_s) {
  const Vec2 degree = wgs84::metres_per_degree(from.where.lat);
  FlightFix to = from;
  const double around = east * horizon_s / std::max(degree.x, 1.0);
  if (!(std::abs(around) < 180))
    return fail(
        Errc::invalid_argument,
        "leads halfway around the earth, or a pole, within the horizon: give a shorter one, "
        "or a trajectory");
  to.where.lon = std::remainder(to.where.lon + around, 360);
  to.where.lat = std::clamp(to.where.lat + north * horizon_s / degree.y, -90.0, 90.0);
  to.height_m += up * horizon_s;
  if (!(std::abs(to.height_m) <= kMostHeight))
    return fail(Errc::invalid_argument,
                "leads further up or down than 100,000 km within the horizon");
  to.time_s += horizon_s;
  return std::vector{from, to};
}

PlanFacts facts_of_tile(std::span<const std::uint8_t> quantized_mesh) {
  PlanFacts facts{quantized_mesh.size()};
  if (quantized_mesh.size() < proto::kMaxHeightAt + sizeof(float)) return facts;
  const auto highest = load<float>(&quantized_mesh[proto::kMaxHeightAt]);
  if (std::isfinite(highest)) facts.highest_m = highest;
  return facts;
}

std::vector<Geographic> places_of(std::span<const FlightFix> flight) {
  std::vector<Geographic> places;
  for (const Step& step : steps_of(flight)) places.push_back({step.camera.lon, step.camera.south});
  return places;
}

Result<FlightPlan> plan_flight(const TileSet& tiles, std::span<const FlightFix> flight,
                               const FlightOptions& o,
                               const std::function<Result<PlanFacts>(TileId)>& facts_of,
                               std::stop_token stop) {
  if (const auto ok = check(flight, o); !ok) return std::unexpected(ok.error());
  auto planned = Planner(tiles, flight, o, facts_of).run(stop);
  if (!planned) return planned;
  FlightPlan& plan = *planned;
  // Among equals parents come first.
  std::ranges::sort(plan.tiles, {},
                    [](const PlannedTile& t) { return std::pair(t.needed_s, t.id); });
  for (PlannedTile& t : plan.tiles) {
    plan.bytes += t.bytes;
    t.arrives_s = 8 * double(plan.bytes) / o.link_bits_per_s;
    plan.lead_s = std::max(plan.lead_s, t.arrives_s - (t.needed_s - flight.front().time_s));
  }
  return planned;
}

}  // namespace tind
