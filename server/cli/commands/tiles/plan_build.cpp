// tind plan-build: what many machines are to make of a DEM, cut into shards.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/memory_limit.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/plan_input.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/pyramid/build/estimate.h"
#include "terrain/pyramid/shards/plan_shards.h"
#include "terrain/pyramid/shards/shard_files.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput input;
  SurfaceInput layers;
  BuildOptions options;
  MethodLine method;
  ShapeFiles shapes;
  ShardWish wish;
  double shard_seconds = 0;
  std::uint64_t memory = kDefaultMemory;
  std::string output, progress = "auto";
  bool json = false, force = false;
};

/// As many as give each so many seconds of one thread.
Result<std::uint64_t> shards_of_seconds(const Surface& surface, const Arguments& a) {
  ProgressBar bar("samples", progress_style(a.progress));
  const auto estimate = estimate_build(surface, a.options, stoppable(bar));
  if (!estimate) return std::unexpected(estimate.error());
  return std::uint64_t(std::clamp(std::ceil(estimate->thread_seconds() / a.shard_seconds), 1.0,
                                  double(kMostShards)));
}

void print(const ShardPlan& plan, const std::string& file, bool json) {
  std::uint64_t least = ~std::uint64_t(0), most = 0;
  for (const auto& s : plan.shards)
    least = std::min(least, s.tiles), most = std::max(most, s.tiles);
  if (json) {
    const nlohmann::ordered_json j = {
        {"plan", file},          {"hash", plan.hash()},   {"shards", plan.shards.size()},
        {"level", plan.level},   {"tiles", plan.tiles()}, {"top_tiles", plan.top_tiles},
        {"fewest_tiles", least}, {"most_tiles", most}};
    fmt::print("{}\n", json::to_text(j, 1));
    return;
  }
  fmt::print(
      "{}: {} tiles in {} shards of {} to {} tiles, subtrees of level {}; {} tiles above them\n"
      "plan {}\n",
      file, plan.tiles(), plan.shards.size(), least, most, plan.level, plan.top_tiles, plan.hash());
}

/// Only a plan is replaced: with "-o *.tif" the first file would be gone.
Result<void> check_replaced(const std::string& path) {
  const auto type = file_type_of(path);
  if (!type) return std::unexpected(type.error());
  if (*type != std::filesystem::file_type::regular) return {};
  const auto head = read_beginning(path, 64);
  if (!head) return std::unexpected(head.error());
  if (head->empty() || head->find("\"tind_plan\"") != head->npos) return {};
  return fail(Errc::invalid_argument,
              path + " is there, and is no plan: name another output, or remove it");
}

/// In place of their plan nobody merges its shards any more; beside those of another none of this
/// one is built.
Result<void> check_shards(const Arguments& a, const std::string& hash) {
  const ShardFolder folder(shards_folder(a.output, ""));
  const auto ours = belongs_to(folder, hash);
  if (ours) return {};
  if (ours.error().code != Errc::bad_data) return ours;  // it cannot be read
  const auto there = is_there(a.output);
  if (!there) return std::unexpected(there.error());
  if (!a.force && *there)
    return fail(Errc::invalid_argument,
                folder.path() +
                    " has shards of another plan, which nobody can merge without it: name "
                    "another output, or --force to replace it all the same");
  warn(ours.error().what + " before shards of this plan are built there (or build them with -o)");
  return {};
}

int run(Arguments a) {
  if (const auto ok = check_replaced(a.output); !ok) return complain(ok.error());
  std::error_code none;  // what cannot be made, the next line says
  if (const auto parent = std::filesystem::path(a.output).parent_path(); !parent.empty())
    std::filesystem::create_directories(parent, none);
  if (const int code = check_outputs({a.output}, inputs_of(a.input, a.layers, a.shapes));
      code != kOk)
    return code;
  DemOptions dem = dem_options(a.input);
  limit_caches(a.memory, a.input, a.layers, dem);
  auto opened = open_surface(a.input, a.layers, dem);
  if (!opened) return complain(opened.error());
  const auto source = with_shapes(std::move(*opened), a.shapes);
  if (!source) return complain(source.error());
  const auto threads = threads_within(a.memory, *source, dem, a.options.threads);
  if (!threads) return complain(threads.error());
  a.options.threads = *threads;
  warn_of_plan(*source, a.options.tiles);
  finish_on_signals();
  if (a.shard_seconds > 0) {
    const auto shards = shards_of_seconds(*source, a);
    if (!shards) return complain(shards.error());
    a.wish.tiles_per_shard = 0, a.wish.shards = *shards;
    // No more than there can be: who asks for seconds does not ask for a number.
    const auto outline = TilePlan::make(*source, HeightRange{}, a.options.tiles);
    if (!outline) return complain(outline.error());
    a.wish.shards =
        std::min<std::uint64_t>(a.wish.shards, outline->tiles(outline->last_level()).size());
  }
  Result<ShardPlan> plan = fail(Errc::internal, "not run");
  {
    ProgressBar bar("posts", progress_style(a.progress));
    plan = plan_shards(*source, a.options, a.wish, planned_source(a.input, a.layers, a.shapes),
                       stoppable(bar));
  }
  if (!plan) return complain(plan.error());
  if (const auto ok = check_shards(a, plan->hash()); !ok) return complain(ok.error());
  if (const auto written = write_whole_file(a.output, encode(*plan)); !written)
    return complain(written.error());
  remove_unfinished(a.output);
  print(*plan, a.output, a.json);
  return kOk;
}

}  // namespace

void add_plan_build(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand(
      "plan-build", "Cut the tile pyramid of a DEM into shards, which many machines make");
  c.add_option("DEM", a->input.files, "raster files");
  c.add_option("-o,--output", a->output, "the plan, e.g. PLAN.json").required();
  c.add_flag("--force", a->force, "replace a plan whose shards are there");
  c.add_option("--shards", a->wish.shards, "how many shards");
  c.add_option("--tiles-per-shard", a->wish.tiles_per_shard,
               "as many shards as have about so many tiles each");
  c.add_option("--shard-seconds", a->shard_seconds,
               "as many shards as take about so long each, on one thread of this machine: some "
               "tiles are made to see, so another run may give another number")
      .positive();
  add_tile_options(c, a->options.tiles);
  add_tile_method(c, a->method);
  a->input.to_datum = "ellipsoid";  // as tind build has it
  add_dem_options(c, a->input);
  add_shape_options(c, a->shapes);
  add_layer_options(c, a->layers);
  c.add_flag("--gzip", a->options.gzip, "as tind build: tiles in a directory are compressed");
  c.add_option("--threads", a->options.threads, "threads (default: one per core)").range(1, 1024);
  add_memory_option(c, a->memory);
  add_progress_option(c, a->progress);
  c.add_flag("--json", a->json, "print the summary as JSON");
  c.footer(
      "Then, anywhere and in any order: tind build --plan PLAN.json --shard i/N. tind status says "
      "how far it is, tind merge makes of the shards what tind build makes at once, byte for byte. "
      "Files are named in the plan as they are named here: absolute names serve everywhere.");
  c.on_run([a, c, &exit] {
    if (!names_any(a->input, a->layers)) refuse_missing("DEM");
    const int said =
        int(c.given("--shards")) + c.given("--tiles-per-shard") + c.given("--shard-seconds");
    if (said == 0) refuse_missing("--shards (or --tiles-per-shard, --shard-seconds)");
    for (const auto& [name, value] : {std::pair{"--shards", a->wish.shards},
                                      std::pair{"--tiles-per-shard", a->wish.tiles_per_shard}})
      if (c.given(name) && value == 0) refuse_value(name, "takes 1 or more");
    if (said > 1) {
      exit = complain(
          {Errc::invalid_argument, "--shards, --tiles-per-shard or --shard-seconds: one of them"});
      return;
    }
    const auto method = set_tile_method(c, a->method, a->options.tiles);
    exit = method ? run(*a) : complain(method.error());
  });
}

}  // namespace tind::cli
