#include "server/cli/commands/tiles/build_scenery.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "proto/tile/layer_json.h"
#include "server/cli/program/exit.h"
#include "terrain/flightgear/scenery_folder.h"
#include "terrain/surface/stated_accuracy.h"

namespace tind::cli {
namespace {

nlohmann::ordered_json to_json(const flightgear::SceneryReport& r,
                               const flightgear::BucketPlan& plan, double seconds) {
  nlohmann::ordered_json j;
  j["vertical_datum"] = name(plan.datum());
  if (const auto stated = stated_accuracy(plan.surface()); !stated.empty())
    j["accuracy"] = proto::accuracy_json(stated);
  j.update({{"buckets", r.buckets},
            {"kept", r.kept},
            {"empty", r.empty},
            {"bytes", r.bytes},
            {"budget_m", r.budget_m},
            {"worst_error_m", r.worst_error_m},
            {"over_budget", r.over_budget},
            {"partly_void", r.partly_void},
            {"void_share", r.void_share},
            {"seconds", seconds}});
  return j;
}

void print(const flightgear::SceneryReport& r, double seconds) {
  fmt::print("{} buckets ({} kept), {} bytes, in {}\n", r.buckets, r.kept, r.bytes,
             duration_text(seconds));
  fmt::print("no post is farther than {:.2f} m from the ground (asked for: {:.2f} m)\n",
             r.worst_error_m, r.budget_m);
  if (r.over_budget > 0)
    fmt::print("{} of the buckets cannot keep their bound; each says its own in its .stg\n",
               r.over_budget);
  if (r.partly_void > 0)
    fmt::print(
        "{} of the buckets reach beyond the known heights, {:.1f} % of all their ground: it "
        "is filled from beside it, and farther away 0 m above the sea\n",
        r.partly_void, r.void_share * 100);
  if (r.empty > 0)
    fmt::print("{} without a valid height have no file: FlightGear has its sea there\n", r.empty);
}

}  // namespace

int build_scenery(const Surface& surface, const Environment& environment,
                  const SceneryArguments& a) {
  const auto plan = flightgear::BucketPlan::make(surface, a.options, environment);
  if (!plan) return complain(plan.error());
  const auto begin = std::chrono::steady_clock::now();
  Result<flightgear::SceneryReport> report = fail(Errc::internal, "not run");
  {
    ProgressBar bar("buckets", progress_style(a.progress));
    report = flightgear::write_scenery(
        *plan, a.output, {.threads = a.threads, .cover = a.cover.get(), .force = a.force},
        a.stoppable(bar));
  }
  if (!report) return complain(report.error());
  if (report->buckets == 0)
    return complain({Errc::bad_data, "no valid height in " + surface.info().files.front() +
                                         ": there is nothing for FlightGear"});
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (a.json)
    fmt::print("{}\n", json::to_text(to_json(*report, *plan, seconds), 1));
  else
    print(*report, seconds);
  return kOk;
}

}  // namespace tind::cli
