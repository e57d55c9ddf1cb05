// tind plan: which tiles a flight needs, in the order of need, and which of them a link
// brings late.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/options/trajectory_file.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/base/file_io.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"
#include "terrain/pyramid/plan/flight_plan.h"
#include "terrain/store/open/open_store.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput tiles;
  TileSetOptions tile_options;
  std::string trajectory;
  std::vector<double> position, velocity;
  double horizon_s = 300, link_mbit = 10, head_start_s = 0;
  std::optional<double> speed, ground_m;
  double tile_bytes = 12000;
  FlightOptions options;
  bool json = false;
};

Result<Dataset> open_dataset(const Arguments& a) {
  if (a.tiles.files.size() == 1 && names_store(a.tiles.files[0]))
    return stored_dataset(a.tiles.files[0]);
  auto dem = open_dem(a.tiles);
  if (!dem) return std::unexpected(dem.error());
  return dem_dataset(std::move(*dem), a.tile_options);
}

Result<std::vector<FlightFix>> flight_of(const Arguments& a) {
  if (a.trajectory.empty() == a.position.empty())
    return fail(Errc::invalid_argument,
                "either --trajectory FILE, or --position with --velocity and --horizon");
  if (a.trajectory.empty()) {
    const FlightFix from{{a.position[0], a.position[1]}, a.position[2], 0};
    if (a.velocity.empty())
      return fail(Errc::invalid_argument, "--position needs a --velocity east,north,up, m/s");
    if (!(std::abs(from.where.lat) <= 90))
      return fail(Errc::invalid_argument, "--position is lon,lat,height: no such latitude");
    if (!(std::abs(from.where.lon) <= 360))
      return fail(Errc::invalid_argument, "--position is lon,lat,height: no such longitude");
    auto flight = straight_flight(from, a.velocity[0], a.velocity[1], a.velocity[2], a.horizon_s);
    if (!flight) return fail(flight.error().code, "--velocity " + flight.error().what);
    return flight;
  }
  const auto text = read_whole_file(a.trajectory);
  if (!text) return std::unexpected(text.error());
  auto flight = parse_trajectory(*text, a.speed);
  if (!flight) return fail(a.trajectory, flight.error());
  return flight;
}

/// Options that nobody would hear are refused.
Result<void> check_heard(const Arguments& a, Command c) {
  const auto unheard = [](const std::string& option, const std::string& why) {
    return fail(Errc::invalid_argument, option + " " + why + ": leave it out");
  };
  for (const char* option : {"--velocity", "--horizon"})
    if (c.given(option) && !a.trajectory.empty())
      return unheard(option, "goes with --position, not with --trajectory");
  if (a.speed && a.trajectory.empty())
    return unheard("--speed", "is of a --trajectory; --velocity says it of a --position");
  if (a.tiles.files.size() != 1 || !names_store(a.tiles.files[0])) return {};
  if (!a.tiles.given.empty()) return unheard(a.tiles.given[0], "is said of DEMs, not of tiles");
  for (const char* option : {"--max-error", "--error-factor", "--deepest", "--levels", "--side",
                             "--exact-posts", "--effort"})
    if (c.given(option))
      return unheard(option, "is for tiles that are made, and these are made already");
  return {};
}

int run(Arguments& a) {
  const auto flight = flight_of(a);
  if (!flight) return complain(flight.error());
  const auto dataset = open_dataset(a);
  if (!dataset) return complain(dataset.error());
  a.options.link_bits_per_s = a.link_mbit * 1e6;
  const auto ground = a.ground_m ? Result<double>(*a.ground_m)
                                 : highest_ground(dataset->source.get(), places_of(*flight));
  if (!ground) return complain(ground.error());
  a.options.ground_m = *ground;
  const auto store = dataset->source ? nullptr : open_store(a.tiles.files[0]);
  const auto plan =
      plan_flight(*dataset->tiles, *flight, a.options, [&](TileId id) -> Result<PlanFacts> {
        const auto known = store ? store->size(id) : Result<std::optional<std::uint64_t>>();
        if (!known) return std::unexpected(known.error());
        PlanFacts facts{known->value_or(0) > 0 ? std::size_t(**known) : std::size_t(a.tile_bytes)};
        // What lies on this machine is opened; over a network that would be the transfer itself.
        if (!store || dataset->tiles->fetched()) return facts;
        const auto tile = dataset->tiles->tile(id, {});
        if (!tile && tile.error().code == Errc::io) return std::unexpected(tile.error());
        if (tile) facts.highest_m = facts_of_tile(tile->bytes).highest_m;
        return facts;
      });
  if (!plan) return complain(plan.error());

  const double begin = flight->front().time_s - a.head_start_s;
  const auto late = [&](const PlannedTile& t) {
    return std::max(0.0, begin + t.arrives_s - t.needed_s);
  };
  std::size_t late_tiles = 0;
  double most = 0;
  for (const PlannedTile& t : plan->tiles)
    late_tiles += late(t) > 0, most = std::max(most, late(t));
  if (a.json) {
    auto list = nlohmann::ordered_json::array();
    for (const PlannedTile& t : plan->tiles)
      list.push_back({{"tile", t.id.text()},
                      {"needed_s", t.needed_s},
                      {"arrives_s", begin + t.arrives_s},
                      {"late_s", late(t)},
                      {"bytes", t.bytes}});
    const nlohmann::ordered_json j = {{"fixes", flight->size()},
                                      {"seconds", flight->back().time_s - flight->front().time_s},
                                      {"link_bits_per_s", a.options.link_bits_per_s},
                                      {"bytes", plan->bytes},
                                      {"lead_s", plan->lead_s},
                                      {"head_start_s", a.head_start_s},
                                      {"late_tiles", late_tiles},
                                      {"most_late_s", most},
                                      {"tiles", std::move(list)}};
    std::printf("%s\n", json::to_text(j, 1).c_str());
    return kOk;
  }
  fmt::print("{:<20} {:>10} {:>10} {:>8} {:>8}\n", "tile", "needed, s", "arrives, s", "late, s",
             "bytes");
  for (const PlannedTile& t : plan->tiles)
    fmt::print("{:<20} {:>10.1f} {:>10.1f} {:>8.1f} {:>8}\n", t.id.text(), t.needed_s,
               begin + t.arrives_s, late(t), t.bytes);
  fmt::print("{} tiles, {:.3g} MB at {:.3g} Mbit/s: {} late, by {:.1f} s at most\n",
             plan->tiles.size(), double(plan->bytes) / 1e6, a.link_mbit, late_tiles, most);
  if (late_tiles > 0)
    fmt::print("none is late when the transfer begins {:.1f} s before the first fix\n",
               plan->lead_s);
  return kOk;
}

}  // namespace

void add_plan(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  a->tiles.to_datum = "ellipsoid";  // as tind build has it
  Command app = program.add_subcommand(
      "plan", "Which tiles a flight needs, in the order of need, and which come late over a link");
  app.add_option("tiles", a->tiles.files,
                 "a directory made by tind build, the URL of a dataset, or a DEM")
      .required();
  app.add_option("--trajectory", a->trajectory,
                 "the flight: CSV (lon,lat,height,time) or a GeoJSON LineString with times");
  app.add_option("--speed", a->speed, "of a trajectory without times, metres a second");
  app.add_option("--position", a->position, "instead of a trajectory: lon,lat,height")
      .delimiter(',')
      .expected(3);
  app.add_option("--velocity", a->velocity,
                 "... with this velocity: east,north,up, metres a second")
      .delimiter(',')
      .expected(3);
  app.add_option("--horizon", a->horizon_s, "... for so many seconds").range(0.0, 86400.0).shown();
  app.add_option("--link", a->link_mbit, "speed of the link, Mbit/s").shown();
  app.add_option("--head-start", a->head_start_s,
                 "the transfer begins so many seconds before the first fix")
      .not_negative()
      .shown();
  app.add_option("--tile-bytes", a->tile_bytes,
                 "what a tile takes where its size is not known: of a URL and of a DEM")
      .range(1.0, 1e9)
      .shown();
  app.add_option("--ground", a->ground_m,
                 "how high the ground is above the ellipsoid, metres, where tiles do not say it: "
                 "of a URL (0 without it) and of a DEM (without it the highest below the flight)")
      .range(-1e5, 1e5);
  app.add_option("--tolerance", a->options.tolerance_px, "error on screen that is allowed, pixels")
      .shown();
  app.add_option("--viewport-height", a->options.viewport_height_px, "of the screen, pixels")
      .shown();
  app.add_option("--fov", a->options.fov_deg, "vertical field of view, degrees").shown();
  add_tile_options(app, a->tile_options);
  add_dem_options(app, a->tiles);
  add_json_flag(app, a->json);
  app.footer("A tile is needed from the moment its parent is refined, as globe clients do it.");
  app.on_run([a, app, &exit] {
    const auto heard = check_heard(*a, app);
    exit = heard ? run(*a) : complain(heard.error());
  });
}

}  // namespace tind::cli
