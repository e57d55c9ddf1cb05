// tind estimate: tiles, bytes, time and memory of a build, before anything is built.

#include "server/cli/commands/tiles/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/program/peak_memory.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/pyramid/build/estimate.h"
#include "terrain/pyramid/shards/shard_plan.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput input;
  SurfaceInput layers;
  BuildOptions options;
  MethodLine method;
  ShapeFiles shapes;
  std::string progress = "auto";
  std::uint64_t shards = 0;
  double dollars_per_core_hour = 0;
  bool json = false;
};

/// What a plan of shards would cost, beside the pass over all posts.
struct ShardCost {
  std::uint64_t shards = 0;
  double core_hours = 0, dollars = 0;  // dollars: 0 where nobody said what an hour costs
  double seconds_each() const { return core_hours * 3600 / double(shards); }
};

nlohmann::ordered_json to_json(const BuildEstimate& e, double peak_mb) {
  nlohmann::ordered_json j;
  j["tiles"] = e.tiles;
  j["sampled"] = e.sampled;
  j["bytes"] = e.bytes;
  j["bytes_standard_error"] = e.bytes_error;
  j["seconds"] = e.seconds;
  j["threads"] = e.threads;
  j["peak_mb"] = peak_mb;
  for (const LevelEstimate& l : e.levels)
    j["levels"].push_back({{"level", l.level},
                           {"tiles", l.tiles},
                           {"sampled", l.sampled},
                           {"bytes", l.bytes},
                           {"thread_seconds", l.seconds}});
  return j;
}

void print(const BuildEstimate& e, double peak_mb) {
  fmt::print("{:>5} {:>10} {:>8} {:>12} {:>14} {:>12}\n", "level", "tiles", "sampled", "bytes/tile",
             "bytes", "ms/tile");
  for (const LevelEstimate& l : e.levels)
    fmt::print("{:>5} {:>10} {:>8} {:>12.0f} {:>14.0f} {:>12.1f}\n", l.level, l.tiles, l.sampled,
               l.bytes / double(l.tiles), l.bytes, 1000 * l.seconds / double(l.tiles));
  fmt::print(
      "{} tiles, about {:.3g} MB (standard error {:.2g} %), in about {} with {} threads, "
      "{:.0f} MB of memory\n",
      e.tiles, e.bytes / 1e6, 100 * e.bytes_error / e.bytes, duration_text(e.seconds), e.threads,
      peak_mb);
}

ShardCost cost_of(const BuildEstimate& e, std::uint64_t shards, double dollars_per_core_hour) {
  const double hours = e.thread_seconds() / 3600;
  return {std::max<std::uint64_t>(1, shards), hours, hours * dollars_per_core_hour};
}

/// A small shard takes less than a second, which is not none.
std::string short_text(double seconds) {
  return seconds < 10 ? fmt::format("{:.2g} s", seconds) : duration_text(seconds);
}

void print(const ShardCost& c) {
  fmt::print("{:.3g} core-hours", c.core_hours);
  if (c.shards > 1)
    fmt::print(", {} shards of about {} each", c.shards, short_text(c.seconds_each()));
  if (c.dollars > 0)
    fmt::print(", {} dollars",
               c.dollars < 1 ? fmt::format("{:.2g}", c.dollars) : fmt::format("{:.2f}", c.dollars));
  fmt::print("\n");
}

}  // namespace

int print_estimate(const Surface& surface, const BuildOptions& options, const std::string& progress,
                   bool json, std::uint64_t shards, double dollars_per_core_hour,
                   const nlohmann::ordered_json* update) {
  Result<BuildEstimate> estimate = fail(Errc::internal, "not run");
  warn_of_plan(surface, options.tiles);
  PeakMemory::forget();
  {
    ProgressBar bar("samples", progress_style(progress));
    estimate = estimate_build(surface, options, bar.progress());
  }
  if (!estimate) return complain(estimate.error());
  if (const auto most = std::min<std::uint64_t>(kMostShards, estimate->levels.back().tiles);
      shards > most)
    return complain(
        {Errc::invalid_argument,
         fmt::format("at most {} shards: a shard has a tile of the deepest level", most)});
  // The samples are made by as many threads as the build has, the largest tiles among them.
  const double peak_mb = PeakMemory::megabytes();
  const ShardCost cost = cost_of(*estimate, shards, dollars_per_core_hour);
  const bool asked = shards > 0 || dollars_per_core_hour > 0;
  if (json) {
    auto j = to_json(*estimate, peak_mb);
    j["core_hours"] = cost.core_hours;
    if (shards > 0) j["shards"] = shards, j["shard_seconds"] = cost.seconds_each();
    if (dollars_per_core_hour > 0) j["dollars"] = cost.dollars;
    if (update) j["update"] = *update;
    fmt::print("{}\n", json::to_text(j, 1));
  } else {
    print(*estimate, peak_mb);
    if (asked) print(cost);
  }
  return kOk;
}

void add_estimate(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand(
      "estimate", "How many tiles a build would make, their bytes, its time and memory");
  c.add_option("DEM", a->input.files, "raster files");
  add_tile_options(c, a->options.tiles);
  add_tile_method(c, a->method);
  a->input.to_datum = "ellipsoid";  // as tind build has it
  add_dem_options(c, a->input);
  add_layer_options(c, a->layers);
  add_shape_options(c, a->shapes);
  c.add_option("--threads", a->options.threads, "threads of the build (default: one per core)")
      .range(1, 1024);
  c.add_flag("--gzip", a->options.gzip, "bytes of compressed tiles");
  c.add_option("--shards", a->shards, "say how long each of so many shards takes on one thread");
  c.add_option("--dollars-per-core-hour", a->dollars_per_core_hour, "say what the tiles cost")
      .positive();
  add_progress_option(c, a->progress);
  c.add_flag("--json", a->json, "print the estimate as JSON");
  c.footer("Some tiles of each level are made to see; nothing is written.");
  c.on_run([a, c, &exit] {
    if (!names_any(a->input, a->layers)) refuse_missing("DEM");
    if (c.given("--shards") && a->shards == 0) refuse_value("--shards", "takes 1 or more");
    if (const auto set = set_tile_method(c, a->method, a->options.tiles); !set) {
      exit = complain(set.error());
      return;
    }
    auto source = open_surface(a->input, a->layers);
    if (source) source = with_shapes(std::move(*source), a->shapes);
    exit = source ? print_estimate(*source, a->options, a->progress, a->json, a->shards,
                                   a->dollars_per_core_hour)
                  : complain(source.error());
  });
}

}  // namespace tind::cli
