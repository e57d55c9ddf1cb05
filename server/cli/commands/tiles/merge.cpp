// tind merge: from the shards of a plan to the tile set.

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/memory_limit.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/plan_input.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/pyramid/shards/merge_shards.h"
#include "terrain/store/open/open_store.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string plan, shards, progress = "auto";
  NamedAgain named;
  MergeOptions options;
  std::uint64_t memory = kDefaultMemory;
  double grace_s = 25;
  bool json = false;
  std::shared_ptr<const Environment> environment;
};

int run(Arguments a) {
  const GraceWatch watch(a.grace_s);
  const auto plan = read_plan(a.plan);
  if (!plan) return complain(plan.error());
  auto folder = shards_to_read(a.plan, a.shards);
  if (!folder) return complain(folder.error());
  a.options.shards.folder = *std::move(folder);
  a.options.shards.abandon = watch.abandon();
  if (const int code = check_store_output(a.options.output); code != kOk) return code;
  const auto before = open_store(a.options.output)->record();
  if (!before) return complain(before.error());
  const auto begin = std::chrono::steady_clock::now();
  const auto open = [&]() -> Result<Surface> {
    return open_planned(*plan, a.named, a.environment, a.memory, a.options.shards.threads);
  };
  Result<MergeReport> report = fail(Errc::internal, "not run");
  {
    ProgressBar bar("merge", progress_style(a.progress));
    report = merge_shards(*plan, open, a.options, bar.progress(watch.finish()));
  }
  if (!report) return complain(report.error());
  if (*before && (*before)->heights != plan->record.heights)
    note(a.options.output +
         " had tiles of other heights, and has those of the plan now; where the "
         "plan is older than they were, plan anew and build what is new");
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (a.json) {
    const nlohmann::ordered_json j = {{"tiles", report->tiles},
                                      {"kept", report->kept},
                                      {"bytes", report->bytes},
                                      {"top_made", report->top_made},
                                      {"seconds", seconds}};
    fmt::print("{}\n", json::to_text(j, 1));
    return kOk;
  }
  fmt::print("{}: {} tiles ({} kept; {} above the shards made now), {} bytes, in {}\n",
             a.options.output, report->tiles, report->kept, report->top_made, report->bytes,
             duration_text(seconds));
  return kOk;
}

}  // namespace

void add_merge(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand(
      "merge", "Make the tile set of the shards of a plan: a directory, PMTiles or MBTiles");
  c.add_option("DEM", a->named.files,
               "where the files are on this machine, if not where the plan says");
  c.add_option("--plan", a->plan, "the plan of tind plan-build").required();
  c.add_option("-o,--output", a->options.output, "a directory, X.pmtiles or X.mbtiles").required();
  add_named_again(c, a->named);
  c.add_option("--shards", a->shards,
               "the directory with the folder shards (default: that of the plan)");
  c.add_flag("--force", a->options.force,
             "replace tiles that tind made of another source or with other options");
  c.add_option("--threads", a->options.shards.threads, "threads (default: one per core)")
      .range(1, 1024);
  add_memory_option(c, a->memory);
  c.add_option("--grace", a->grace_s,
               "seconds from a signal until the program has ended, with exit code 75")
      .positive()
      .shown();
  add_progress_option(c, a->progress);
  c.add_flag("--json", a->json, "print the summary as JSON");
  c.footer(
      "Exit code 75: shards are missing; 65: some are not as their records say; 74: some "
      "cannot be read. Nothing is made then. layer.json comes last, an archive has its name only "
      "when it is whole.");
  c.on_run([a, c, &exit] {
    a->environment = c.environment();
    exit = run(*a);
  });
}

}  // namespace tind::cli
