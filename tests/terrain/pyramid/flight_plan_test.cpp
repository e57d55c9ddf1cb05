// Tiles in the order of need: over a narrow link none is late with the plan, and most are without.

#include "terrain/pyramid/plan/flight_plan.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/raster/dem_source.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/support.h"

namespace tind {
namespace {

FlightPlan plan_of(const TileSet& tiles, std::span<const FlightFix> flight,
                   const FlightOptions& options, std::size_t bytes = 10000) {
  auto plan = plan_flight(tiles, flight, options, [&](TileId) { return PlanFacts{bytes}; });
  EXPECT_TRUE(plan) << plan.error().what;
  return plan ? *plan : FlightPlan{};
}

TEST(FlightPlan, ParentsComeFirstAndDeadlinesAreInOrder) {
  const test::MadeUpTiles tiles(9);
  const auto flight = straight_flight({{7.5, 46.5}, 3000, 0}, 250, 0, 0, 300).value();
  const FlightPlan plan = plan_of(tiles, flight, {});
  ASSERT_GT(plan.tiles.size(), 50u);
  std::set<TileId> sent;
  double last = 0;
  for (const PlannedTile& t : plan.tiles) {
    EXPECT_TRUE(t.id.level == 0 || sent.contains(t.id.parent())) << t.id.text();
    EXPECT_TRUE(sent.insert(t.id).second);
    EXPECT_GE(t.needed_s, last);
    last = t.needed_s;
    EXPECT_LE(t.arrives_s, t.needed_s + plan.lead_s + 1e-9);
  }
}

TEST(FlightPlan, AFlightThatStandsStillNeedsItsFirstViewAlone) {
  const test::MadeUpTiles tiles(9);
  const FlightFix here{{7.5, 46.5}, 3000, 100};
  const FlightPlan plan = plan_of(tiles, std::vector{here, FlightFix{{7.5, 46.5}, 3000, 400}}, {});
  for (const PlannedTile& t : plan.tiles) EXPECT_EQ(t.needed_s, 100);
  EXPECT_DOUBLE_EQ(plan.lead_s, 8.0 * double(plan.bytes) / 10e6);
}

TEST(FlightPlan, AcrossTheAntimeridian) {
  const test::MadeUpTiles tiles(8);
  const std::vector<FlightFix> flight = {{{179.9, 10}, 3000, 0}, {{-179.9, 10}, 3000, 90}};
  const FlightPlan there = plan_of(tiles, flight, {});
  bool east = false, west = false;
  for (const PlannedTile& t : there.tiles) {
    const std::uint32_t last = tiling::columns(8) - 1;  // not once around the earth
    EXPECT_TRUE(t.id.level < 8 || t.id.x < 40 || t.id.x > last - 40) << t.id.text();
    east |= t.id.level == 8 && t.id.x == 0;
    west |= t.id.level == 8 && t.id.x == tiling::columns(8) - 1;
  }
  EXPECT_TRUE(east && west);
}

TEST(FlightPlan, WhatMakesNoSenseIsRefused) {
  const test::MadeUpTiles tiles(4);
  const auto refused = [&](std::vector<FlightFix> flight, FlightOptions o) {
    const auto plan = plan_flight(tiles, flight, o, [](TileId) { return PlanFacts{1}; });
    return plan ? std::string() : plan.error().what;
  };
  EXPECT_NE(refused({}, {}).find("empty"), std::string::npos);
  EXPECT_NE(refused({{{0, 91}, 0, 0}}, {}).find("not on earth"), std::string::npos);
  EXPECT_NE(refused({{{0, NAN}, 0, 0}}, {}).find("not on earth"), std::string::npos);
  EXPECT_NE(refused({{{0, 0}, 0, 5}, {{0, 0}, 0, 4}}, {}).find("back in time"), std::string::npos);
  EXPECT_NE(refused({{{0, 0}, 0, 0}}, {.tolerance_px = 0}).find("positive"), std::string::npos);
  EXPECT_NE(refused({{{0, 0}, 0, 0}}, {.max_tiles = 3}).find("more than 3"), std::string::npos);
}

/// The client's own rule, asked ten times a second, with nothing of the planner's in it.
struct Viewer {
  const TileSet& tiles;
  FlightOptions o;
  std::map<TileId, double> first = {};

  static double metres(const FlightFix& c, TileId id) {
    const GeoRect r = tiling::rect(id);
    const double lon = std::clamp(c.where.lon, r.west, r.east) - c.where.lon;
    const double lat = std::clamp(c.where.lat, r.south, r.north) - c.where.lat;
    return std::hypot(lon * 111320 * std::cos(c.where.lat * M_PI / 180), lat * 111320, c.height_m);
  }
  void look(const FlightFix& camera, TileId id) {
    if (!tiles.available(id)) return;
    first.try_emplace(id, camera.time_s);
    const double pixels = tiling::level_error(id.level) * o.viewport_height_px /
                          (2 * std::tan(o.fov_deg / 2 * M_PI / 180) * metres(camera, id));
    if (pixels <= o.tolerance_px || id.level == tiles.layer().maxzoom) return;
    for (int i = 0; i < 4; ++i) look(camera, id.child(i % 2, i / 2));
  }
};

/// Every step asked at every tile: what the planner must find with few questions.
std::map<TileId, double> every_step(const TileSet& tiles, std::span<const FlightFix> flight,
                                    const FlightOptions& o, std::size_t& looks) {
  const double reach =
      o.viewport_height_px / (2 * std::tan(o.fov_deg / 2 * M_PI / 180) * o.tolerance_px);
  const double degree = wgs84::metres_per_degree(0).y;
  std::map<TileId, double> first;
  looks = 0;
  const auto look = [&](auto&& self, const FlightFix& c, double slack, TileId id) -> void {
    if (!tiles.available(id)) return;
    first.try_emplace(id, c.time_s);
    if (id.level == tiles.layer().maxzoom) return;
    ++looks;
    const GeoRect r = tiling::rect(id);
    const double off = std::abs(std::remainder(c.where.lon - (r.west + r.east) / 2, 360));
    const double lon = std::max(0.0, off - r.width() / 2);
    const double lat = std::max({0.0, r.south - c.where.lat, c.where.lat - r.north});
    const double nearest = std::clamp(c.where.lat, r.south, r.north);
    const double scale =
        std::min(std::cos(nearest * M_PI / 180), std::cos(c.where.lat * M_PI / 180));
    const double metres = std::hypot(lon * degree * scale, lat * degree, std::max(0.0, c.height_m));
    if (metres - slack >= tiling::level_error(id.level) * reach) return;
    for (int i = 0; i < 4; ++i) self(self, c, slack, id.child(i % 2, i / 2));
  };
  const auto look_from = [&](const FlightFix& c, double slack) {
    for (std::uint32_t x = 0; x < 2; ++x) look(look, c, slack, {0, x, 0});
  };
  look_from(flight.front(), 0);
  const double length = std::max(1.0, (flight.back().time_s - flight.front().time_s) / 1000);
  for (std::size_t i = 0; i + 1 < flight.size(); ++i) {
    const FlightFix &a = flight[i], &b = flight[i + 1];
    const double lon = std::remainder(b.where.lon - a.where.lon, 360);
    const int steps = std::max(1, int(std::ceil((b.time_s - a.time_s) / length)));
    const auto at = [&](double s) {
      return FlightFix{{a.where.lon + s * lon, a.where.lat + s * (b.where.lat - a.where.lat)},
                       a.height_m + s * (b.height_m - a.height_m),
                       a.time_s + s * (b.time_s - a.time_s)};
    };
    for (int k = 0; k < steps; ++k) {
      const FlightFix from = at(double(k) / steps), to = at(double(k + 1) / steps);
      look_from(from,
                std::hypot((to.where.lon - from.where.lon) * degree,
                           (to.where.lat - from.where.lat) * degree, to.height_m - from.height_m));
    }
  }
  return first;
}

TEST(FlightPlan, FewQuestionsFindWhatEveryStepFinds) {
  const test::MadeUpTiles tiles(9);
  std::mt19937 random(5);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * double(random()) / double(std::mt19937::max());
  };
  for (int round = 0; round < 24; ++round) {
    // Straight ones, turning ones, and ones that are here and there by turns.
    const double lon = uniform(-180, 180), lat = uniform(-85, 85);
    const double spread = round % 3 == 0 ? 0.5 : round % 3 == 1 ? 3 : 40;
    std::vector<FlightFix> flight;
    const int fixes = round % 2 == 0 ? 2 : 40;
    for (int i = 0; i < fixes; ++i)
      flight.push_back({{std::remainder(lon + uniform(-spread, spread), 360),
                         std::clamp(lat + uniform(-spread, spread), -90.0, 90.0)},
                        uniform(-100, 9000),
                        400.0 * i / fixes});
    FlightOptions o;
    o.max_tiles = 1'000'000;
    o.tolerance_px = round % 4 == 0 ? 2 : 12;
    std::size_t looks = 0;
    const auto expected = every_step(tiles, flight, o, looks);
    const FlightPlan plan = plan_of(tiles, flight, o);
    ASSERT_EQ(plan.tiles.size(), expected.size()) << round;
    for (const PlannedTile& t : plan.tiles) {
      ASSERT_TRUE(expected.contains(t.id)) << round << " " << t.id.text();
      EXPECT_EQ(t.needed_s, expected.at(t.id)) << round << " " << t.id.text();
    }
    EXPECT_LT(plan.looks, 150 * plan.tiles.size()) << round;
    if (spread < 10 && plan.tiles.size() > 1000) {
      EXPECT_LT(plan.looks, looks / 3) << round;
    }
  }
}

TEST(FlightPlan, ItsCostIsBoundedWhateverTheFlight) {
  const test::MadeUpTiles tiles(9);
  std::vector<FlightFix> zigzag, circle;
  for (int i = 0; i < 10'000; ++i) {
    zigzag.push_back({{i % 2 == 0 ? 7.0 : 9.0, 46 + i * 1e-5}, 0, i / 10.0});
    circle.push_back({{8 + std::cos(i * 0.01), 46 + std::sin(i * 0.01)}, 500, i / 10.0});
  }
  FlightOptions o;
  o.tolerance_px = 1;
  for (const auto& flight : {zigzag, circle}) {
    const auto plan = plan_flight(tiles, flight, o, [](TileId) { return PlanFacts{1}; });
    if (plan) {
      EXPECT_LT(plan->looks, 200 * plan->tiles.size());
    }
  }
}

TEST(FlightPlan, AStraightFlightStaysOnEarth) {
  EXPECT_FALSE(straight_flight({{10, 90}, 3000, 0}, 250, 0, 0, 300));
  EXPECT_FALSE(straight_flight({{10, 60}, 3000, 0}, 250, 0, 0, 86400));
  EXPECT_FALSE(straight_flight({{10, 60}, 3000, 0}, 0, 0, 1e5, 86400));
  const auto north = straight_flight({{10, 89}, 3000, 0}, 0, 250, 0, 3000);
  ASSERT_TRUE(north);
  EXPECT_EQ(north->back().where.lat, 90) << "it ends at the pole";
  const auto across = straight_flight({{359.9, 0}, 3000, 0}, 250, 0, 0, 300);
  ASSERT_TRUE(across);
  EXPECT_NEAR(across->back().where.lon, -0.1 + 75'000 / 111'320.0, 1e-3);
  const test::MadeUpTiles tiles(5);
  for (const auto& flight : {*north, *across})
    EXPECT_FALSE(plan_of(tiles, flight, {}).tiles.empty());
}

TEST(FlightPlan, IsNearerToGroundThatIsHigher) {
  const test::MadeUpTiles tiles(12);
  const auto flight = [](double height) {
    return straight_flight({{7.5, 46.5}, height, 0}, 250, 0, 0, 60).value();
  };
  const auto ids = [&](double height, const FlightOptions& o, std::optional<double> said) {
    const auto plan = plan_flight(tiles, flight(height), o, [&](TileId id) {
      return PlanFacts{1, id.level < 4 ? said : std::nullopt};  // deeper ones are as their parents
    });
    EXPECT_TRUE(plan) << plan.error().what;
    std::set<TileId> out;
    for (const PlannedTile& t : plan->tiles) out.insert(t.id);
    return out;
  };
  const auto low = ids(300, {}, {});
  EXPECT_LT(ids(4300, {}, {}).size(), low.size());
  EXPECT_EQ(ids(4300, {.ground_m = 4000}, {}), low);
  EXPECT_EQ(ids(4300, {}, 4000), low);
  EXPECT_EQ(ids(4300, {.ground_m = 9000}, 4000), low);  // tiles know better
}

TEST(FlightPlan, StopsWhenToldTo) {
  const test::MadeUpTiles tiles(9);
  std::stop_source stop;
  stop.request_stop();
  const auto plan = plan_flight(
      tiles, straight_flight({{7.5, 46.5}, 3000, 0}, 250, 0, 0, 300).value(), {},
      [](TileId) { return PlanFacts{1}; }, stop.get_token());
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, Errc::cancelled);
}

TEST(FlightPlan, FailsWhereATileCannotBeLookedAt) {
  const test::MadeUpTiles tiles(9);
  const auto flight = straight_flight({{7.5, 46.5}, 3000, 0}, 250, 0, 0, 300).value();
  const auto plan = plan_flight(tiles, flight, {}, [](TileId id) -> Result<PlanFacts> {
    if (id.level == 5) return fail(Errc::io, "tile " + id.text());
    return PlanFacts{1};
  });
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, Errc::io);
  EXPECT_TRUE(plan.error().what.starts_with("tile 5/")) << plan.error().what;
}

TEST(FlightPlan, NoTileIsLateOverATenMegabitLink) {
  TIND_NEEDS_SHARED_DATA(east, "dem/N49W123.tif");
  TIND_NEEDS_SHARED_DATA(west, "dem/N49W124.tif");
  auto source = DemSource::open(std::vector{west, east}, {.from_datum = VerticalDatum::egm96});
  ASSERT_TRUE(source) << source.error().what;
  const auto set = open_dem_tiles(std::move(*source), {});
  ASSERT_TRUE(set) << set.error().what;
  std::map<TileId, std::size_t> sizes;  // as they are, not as they are estimated
  const auto bytes_of = [&](TileId id) {
    auto [found, fresh] = sizes.try_emplace(id, 0);
    if (fresh) found->second = (*set)->tile(id, {})->bytes.size();
    return found->second;
  };
  const auto facts_of = [&](TileId id) { return PlanFacts{bytes_of(id)}; };
  const FlightOptions o;
  const auto flight = straight_flight({{-123.9, 49.1}, 3000, 0}, 200, 150, 0, 300).value();
  const auto plan = plan_flight(**set, flight, o, facts_of);
  ASSERT_TRUE(plan) << plan.error().what;

  Viewer viewer{**set, o};
  for (int i = 0; i <= 3000; ++i) {
    FlightFix camera = flight[0];
    camera.where.lon += i / 3000.0 * (flight[1].where.lon - flight[0].where.lon);
    camera.where.lat += i / 3000.0 * (flight[1].where.lat - flight[0].where.lat);
    camera.time_s = i / 10.0;
    for (std::uint32_t x = 0; x < 2; ++x) viewer.look(camera, {0, x, 0});
  }
  std::map<TileId, double> arrives;
  double sent = 0;
  for (const PlannedTile& t : plan->tiles)
    arrives[t.id] = (sent += 8.0 * double(bytes_of(t.id)) / o.link_bits_per_s) - plan->lead_s;

  // On demand: asked for when needed, one after the other on the same link, the first view (which
  // nobody can have in time) granted as loaded.
  std::multimap<double, TileId> by_need;
  for (const auto& [id, time] : viewer.first) by_need.emplace(time, id);
  std::size_t late = 0, late_on_demand = 0, after_start = 0;
  double worst = 0, free_at = 0;
  for (const auto& [time, id] : by_need) {
    ASSERT_TRUE(arrives.contains(id)) << id.text() << " is needed, but not in the plan";
    late += arrives[id] > time + 1e-6;
    if (time == 0) continue;
    ++after_start;
    free_at = std::max(free_at, time) + 8.0 * double(bytes_of(id)) / o.link_bits_per_s;
    late_on_demand += free_at > time + 0.02;  // later than one frame
    worst = std::max(worst, free_at - time);
  }
  std::printf(
      "%zu tiles, %zu bytes, lead %.1f s; needed after the start: %zu; late with the plan: "
      "%zu; on demand: %zu later than 20 ms, the worst %.2f s\n",
      plan->tiles.size(), plan->bytes, plan->lead_s, after_start, late, late_on_demand, worst);
  EXPECT_EQ(late, 0u);
  EXPECT_GT(late_on_demand, 0u);
}

}  // namespace
}  // namespace tind
