#include "server/cli/commands/tiles/build_shard.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/options/plan_input.h"
#include "server/cli/options/shard_number.h"
#include "server/cli/program/exit.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/peak_memory.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/pyramid/shards/make_shard.h"

namespace tind::cli {

namespace {

nlohmann::ordered_json to_json(std::size_t shard, const ShardReport& r, double seconds) {
  return {{"shard", shard_name(shard)},
          {"tiles", r.tiles},
          {"made", r.made},
          {"kept", r.kept},
          {"bytes", r.bytes},
          {"sha256", r.sha256},
          {"there", r.there},
          {"seconds", seconds},
          {"peak_mb", PeakMemory::megabytes()}};
}

void print(std::size_t shard, const ShardReport& r, double seconds) {
  if (r.there)
    fmt::print("shard {}: there, {} tiles\n", shard_name(shard), r.tiles);
  else
    fmt::print("shard {}: {} tiles ({} made, {} kept), {} bytes, in {}\n", shard_name(shard),
               r.tiles, r.made, r.kept, r.bytes, duration_text(seconds));
}

}  // namespace

void add_shard_options(Command c, ShardLine& line) {
  c.add_option("--plan", line.plan,
               "make shards of a plan of tind plan-build, instead of a directory of tiles; DEM "
               "files, --layer, --water and other lines say where the files are, if not where the "
               "plan says");
  c.add_option("--shard", line.shard,
               "which of the plan: i/N (i from 0), top (the levels above the shards), or auto: "
               "from the variables of Slurm, Kubernetes, AWS Batch, MPI or GNU parallel");
  c.add_option("--grace", line.grace_s,
               "with --plan: seconds from a signal until the program has ended, with exit code 75")
      .positive()
      .shown();
}

int build_shards(const ShardLine& line, const std::string& output, const NamedAgain& named,
                 std::shared_ptr<const Environment> environment, std::uint64_t memory, int threads,
                 const std::string& progress, bool json) {
  const GraceWatch watch(line.grace_s);
  const auto plan = read_plan(line.plan);
  if (!plan) return complain(plan.error());
  const auto shards = shards_to_make(line.shard, plan->shards.size(), environment_variables());
  if (!shards) return complain(shards.error());
  const std::string folder = shards_folder(line.plan, output);
  if (const auto ours = belongs_to(ShardFolder(folder), plan->hash()); !ours)
    return complain(ours.error());
  const auto surface = open_planned(*plan, named, std::move(environment), memory, threads);
  if (!surface) {
    for (const std::size_t shard : *shards)
      leave_error(ShardFolder(folder), shard, surface.error());
    return complain(surface.error());
  }
  auto reports = nlohmann::ordered_json::array();
  for (const std::size_t shard : *shards) {
    const auto begin = std::chrono::steady_clock::now();
    Result<ShardReport> report = fail(Errc::internal, "not run");
    {
      ProgressBar bar("shard " + shard_name(shard), progress_style(progress));
      report = make_shard(*surface, *plan, shard,
                          {.folder = folder, .threads = threads, .abandon = watch.abandon()},
                          bar.progress(watch.finish()));
    }
    if (!report) return complain(report.error());
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (json)
      reports.push_back(to_json(shard, *report, seconds));
    else
      print(shard, *report, seconds);
  }
  if (json) fmt::print("{}\n", json::to_text(reports.size() == 1 ? reports[0] : reports, 1));
  return kOk;
}

}  // namespace tind::cli
