// tind verify: are the bytes of a store those that were written? With --repair, what is not is made
// again.

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/progress_bar.h"
#include "server/log/printable.h"
#include "terrain/check/verify_store.h"
#include "terrain/pyramid/build/repair.h"
#include "terrain/store/open/open_store.h"

namespace tind::cli {

namespace {

constexpr std::size_t kShown = 10;  // of each list

struct Arguments {
  std::string where, progress = "auto";
  DemInput dem;
  SurfaceInput layers;
  ShapeFiles shapes;
  int threads = 0;
  bool repair = false, json = false;
};

struct Kind {
  const char *key, *what;
  const VerifyReport::Tiles VerifyReport::*tiles;
};
constexpr Kind kKinds[] = {
    {"damaged", "damaged: other bytes than were written", &VerifyReport::damaged},
    {"unread", "cannot be read, and may be sound", &VerifyReport::unread},
    {"missing", "missing", &VerifyReport::missing},
    {"unlisted", "there, and nothing vouches for them", &VerifyReport::unlisted},
    {"foreign", "foreign: no part of the set; remove them", &VerifyReport::foreign}};

nlohmann::ordered_json to_json(const VerifyReport& r) {
  nlohmann::ordered_json j = {
      {"ok", r.ok()}, {"tiles", r.tiles}, {"sound", r.sound}, {"bytes", r.bytes}};
  for (const Kind& kind : kKinds) {
    const VerifyReport::Tiles& tiles = r.*kind.tiles;
    j[kind.key] = {{"count", tiles.count}, {"tiles", tiles.named}};
  }
  j["faults"] = nlohmann::ordered_json::array();
  for (const StoreFault& fault : r.faults)
    j["faults"].push_back({{"name", fault.name}, {"what", fault.what}});
  j["others"] = r.others;
  return j;
}

std::string list_of(const std::vector<std::string>& names, std::uint64_t count) {
  std::string text;
  for (std::size_t k = 0; k < std::min(names.size(), kShown); ++k)
    text += (k > 0 ? ", " : "") + logging::printable(names[k]);
  return text + (count > kShown ? ", ..." : "");
}

void print(const VerifyReport& r) {
  for (const Kind& kind : kKinds)
    if (const VerifyReport::Tiles& tiles = r.*kind.tiles; tiles.count > 0)
      fmt::print("{} {}: {}\n", tiles.count, kind.what, list_of(tiles.named, tiles.count));
  for (const StoreFault& fault : r.faults)
    fmt::print("{}: {}\n", logging::printable(fault.name), logging::printable(fault.what));
  if (!r.others.empty())
    fmt::print("beside the tiles lie, of no harm: {}\n", list_of(r.others, r.others.size()));
  fmt::print("{} of {} tiles are as they were written, {} bytes{}\n", r.sound, r.tiles, r.bytes,
             r.ok() ? "" : ": NOT whole");
}

void print(const nlohmann::ordered_json& j) { fmt::print("{}\n", json::to_text(j, 1)); }

Result<VerifyReport> look(const Arguments& a) {
  ProgressBar bar("verify", progress_style(a.progress));
  return verify_store(*open_store(a.where), a.threads, stoppable(bar));
}

Result<RepairReport> repair(const Arguments& a) {
  auto dem = open_surface(a.dem, a.layers);
  if (!dem) return std::unexpected(dem.error());
  const auto source = with_shapes(std::move(*dem), a.shapes);
  if (!source) return std::unexpected(source.error());
  ProgressBar bar("repair", progress_style(a.progress));
  return repair_tiles(*source, a.where, a.threads, stoppable(bar));
}

int run(const Arguments& a) {
  if (!names_store(a.where)) return complain(no_store(a.where));
  finish_on_signals();
  auto report = look(a);
  if (!report) return complain(report.error());
  nlohmann::ordered_json j = to_json(*report);
  if (a.repair && !report->ok()) {
    if (!a.json) print(*report);
    const auto mended = repair(a);
    if (!mended) {
      if (a.json) print(j);  // what is broken is known, whoever cannot mend it
      return complain(mended.error());
    }
    report = look(a);
    if (!report) return complain(report.error());
    nlohmann::ordered_json after = to_json(*report);
    after["made"] = mended->made;
    after["before"] = std::move(j);
    j = std::move(after);
    if (!a.json) fmt::print("{} tiles were made again\n", mended->made);
  }
  if (a.json)
    print(j);
  else
    print(*report);
  return report->ok() ? kOk : report->all_read() ? kBadData : kIo;
}

}  // namespace

void add_verify(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand(
      "verify",
      "Hold every tile of a store against the hash that was kept when it was written; mend it");
  c.add_option("STORE", a->where, "a directory of tiles, X.pmtiles or X.mbtiles; also at s3://")
      .required();
  c.add_flag("--repair", a->repair,
             "make again what is damaged or missing, of --source or --layer, with the options that "
             "the build had for them; foreign files stay");
  c.add_option("--source", a->dem.files,
               "the DEM, or the files of all layers, that the tiles were made of");
  a->dem.to_datum = "ellipsoid";  // as tind build has it
  add_dem_options(c, a->dem);
  add_shape_options(c, a->shapes);
  add_layer_options(c, a->layers);
  c.add_option("--threads", a->threads, "threads to use, 0: one per core").not_negative().shown();
  add_progress_option(c, a->progress);
  c.add_flag("--json", a->json, "print the report as JSON");
  c.footer(
      "Exit code 0: every byte is as it was written, at the end where --repair mended it; 65: "
      "it is not, or --repair cannot tell how it was made (there is no record, or an image had "
      "a say), or its source is broken; 74: some of it cannot be read, and may be sound, or "
      "writing failed; 2: wrong arguments, or --repair was not given what the tiles were made "
      "of, and changed nothing; 69: there is no such store, or no such source; 75: stopped, or "
      "somebody else is at work on the store: run it again. What was found is printed where "
      "--repair fails, too, with --json without `made` and `before`. Of the layer.json of a "
      "folder only which tiles it names is looked at: no hash of it is kept, as archives have "
      "one. For --repair the store's record knows how exact the tiles are, their levels, method "
      "and effort. What they were made of has to be said as it was to tind build: the files, "
      "the options of DEMs (--from-datum, --nodata, --crs ...), --layer, --layer-option, "
      "--blend, --layer-error, --breaklines, --flatten, --boundary, --water and --line-heights.");
  c.on_run([a, c, &exit] {
    const bool source = names_any(a->dem, a->layers);
    if (a->repair && !source) refuse_missing("--source");
    if (source && !a->repair) {
      exit = complain(
          {Errc::invalid_argument, "--source is for --repair; tind check compares tiles with it"});
      return;
    }
    exit = run(*a);
  });
}

}  // namespace tind::cli
