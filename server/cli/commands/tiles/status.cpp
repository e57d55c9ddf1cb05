// tind status: how far the shards of a plan are.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/plan_input.h"
#include "server/log/printable.h"
#include "terrain/check/verify_store.h"
#include "terrain/pyramid/shards/merge_shards.h"
#include "terrain/pyramid/shards/shard_files.h"
#include "terrain/store/open/open_store.h"

namespace tind::cli {

namespace {

constexpr std::size_t kShown = 20;  // of each state

struct Arguments {
  std::string plan, shards, output;
  StatusOptions options;
  bool json = false;
};

/// Of the shards; the top is the last, and none of them.
std::array<std::size_t, 4> counts(const std::vector<ShardStatus>& all) {
  std::array<std::size_t, 4> n{};
  for (std::size_t i = 0; i + 1 < all.size(); ++i) ++n[std::size_t(all[i].state)];
  return n;
}

std::string name_at(std::size_t i, std::size_t count) {
  return i + 1 == count ? "top" : std::to_string(i);
}

nlohmann::ordered_json to_json(const ShardPlan& plan, const std::vector<ShardStatus>& all,
                               std::optional<bool> merged) {
  const auto n = counts(all);
  std::uint64_t made = 0;
  for (const ShardStatus& s : all) made += s.made;
  nlohmann::ordered_json j = {{"plan", plan.hash()},   {"shards", plan.shards.size()},
                              {"done", n[0]},          {"running", n[1]},
                              {"failed", n[2]},        {"missing", n[3]},
                              {"tiles", plan.tiles()}, {"made", made}};
  j["top"] = name_of(all.back().state);
  if (!all.back().what.empty()) j["top_why"] = all.back().what;
  if (merged) j["merged"] = *merged;
  j["not_done"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    const ShardStatus& s = all[i];
    if (s.state == ShardState::done) continue;
    nlohmann::ordered_json one = {{"shard", i}, {"state", name_of(s.state)}, {"tiles", s.tiles}};
    if (s.state == ShardState::running)
      one["made"] = s.made, one["where"] = s.where, one["silent_s"] = s.silent_s;
    if (!s.what.empty()) one["why"] = s.what;
    j["not_done"].push_back(std::move(one));
  }
  return j;
}

void print(const std::vector<ShardStatus>& all) {
  for (const ShardState state : {ShardState::running, ShardState::failed, ShardState::missing}) {
    std::size_t shown = 0, more = 0;
    std::string missing;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const ShardStatus& s = all[i];
      if (s.state != state || (i + 1 == all.size() && state == ShardState::missing)) continue;
      if (++shown > kShown) {
        ++more;
        continue;
      }
      const std::string name = name_at(i, all.size());
      if (state == ShardState::running)
        fmt::print("running {:>6}: {} of {} tiles, on {}\n", name, s.made, s.tiles,
                   logging::printable(s.where));
      else if (state == ShardState::failed)
        fmt::print("failed  {:>6}: {}\n", name, logging::printable(s.what));
      else
        missing += (missing.empty() ? "" : ", ") + name;
    }
    if (!missing.empty()) fmt::print("missing: {}{}\n", missing, more > 0 ? ", ..." : "");
    if (more > 0) fmt::print("{} more {}\n", more, name_of(state));
  }
  const auto n = counts(all);
  const ShardState top = all.back().state;
  fmt::print("{} of {} shards done, {} running, {} failed, {} missing; the top: {}\n", n[0],
             all.size() - 1, n[1], n[2], n[3],
             top == ShardState::missing ? "not yet, tind merge makes it" : name_of(top));
}

/// By its record and the number of its tiles; or by every byte.
Result<bool> merged_whole(const ShardPlan& plan, const Arguments& a) {
  const auto merged = is_merged(plan, a.output);
  if (!merged || !*merged || !a.options.every_byte) return merged;
  const auto report = verify_store(*open_store(a.output));
  if (!report) return std::unexpected(report.error());
  return report->ok();
}

/// Failed, and not just because it could not be read.
bool is_damaged(const ShardStatus& s) { return s.state == ShardState::failed && !s.unread; }

bool is_anything(const std::string& path) {
  std::error_code none;
  return std::filesystem::exists(path, none);
}

int run(const Arguments& a) {
  const auto plan = read_plan(a.plan);
  if (!plan) return complain(plan.error());
  const auto folder = shards_to_read(a.plan, a.shards);
  if (!folder) return complain(folder.error());
  const auto all = shard_status(*plan, ShardFolder(*folder), a.options);
  if (!all) return complain(all.error());
  std::optional<bool> merged;
  if (!a.output.empty()) {
    const auto whole = merged_whole(*plan, a);
    if (!whole) return complain(whole.error());
    merged = *whole;
  }
  if (a.json) {
    fmt::print("{}\n", json::to_text(to_json(*plan, *all, merged), 1));
  } else {
    print(*all);
    if (merged)
      fmt::print("{} is {}\n", a.output,
                 *merged                 ? "there"
                 : is_anything(a.output) ? "not what the plan makes, or not all of it"
                                         : "not there");
  }
  const auto n = counts(*all);
  if (n[2] > 0 || all->back().state == ShardState::failed)
    return std::ranges::any_of(*all, is_damaged) ? kBadData : kIo;
  return n[0] == plan->shards.size() && merged.value_or(true) ? kOk : kTryAgain;
}

}  // namespace

void add_status(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand("status",
                                     "Which shards of a plan are done, running, failed or missing");
  c.add_option("--plan", a->plan, "the plan of tind plan-build").required();
  c.add_option("--shards", a->shards,
               "the directory with the folder shards (default: that of the plan)");
  c.add_option(
      "-o,--output", a->output,
      "also say whether what tind merge makes of the plan is there: a directory, X.pmtiles "
      "or X.mbtiles");
  c.add_flag("--every-byte", a->options.every_byte,
             "hash every pack, and every tile of --output; without it sizes and numbers alone are "
             "compared with the records");
  c.add_option("--silence", a->options.silence_s,
               "a run that was not heard of for so many seconds is none any more")
      .positive()
      .shown();
  c.add_flag("--json", a->json, "print the status as JSON");
  c.footer(
      "Exit code 0: all shards are done (and merged, with --output); 75: not yet; 65: some failed, "
      "or are not as their records say; 74: some cannot be read, and may be sound. What an engine "
      "says of its jobs does not count.");
  c.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
