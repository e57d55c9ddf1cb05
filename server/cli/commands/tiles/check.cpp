// tind check: is a tile set what it says it is? Anyone's tiles, in a directory or on a server; exit
// code 0 only where all could be read and nothing is violated.

#include "terrain/check/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/program/progress_bar.h"
#include "server/log/printable.h"
#include "terrain/check/check_tileset.h"
#include "terrain/check/tileset_files.h"
#include "terrain/surface/stated_accuracy.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string where;
  DemInput dem;
  SurfaceInput layers;
  CheckOptions options;
  ShapeFiles shapes;  // of the source
  std::string progress = "auto";
  bool json = false, list_rules = false;
};

const char* name_of(Severity severity) {
  switch (severity) {
    case Severity::violation:
      return "violation";
    case Severity::warning:
      return "warning";
    case Severity::unread:
      return "unread";
  }
  return "";
}

void print_rules() {
  for (const CheckRule& r : kCheckRules)
    fmt::print("{:<18} {:<9} {}\n", r.id, name_of(r.severity), r.demands);
}

nlohmann::ordered_json to_json(const CheckReport& report, const std::optional<Surface>& source) {
  const bool with_source = source.has_value();
  nlohmann::ordered_json json;
  json["ok"] = report.ok();
  json["violations"] = report.findings.total(Severity::violation);
  json["warnings"] = report.findings.total(Severity::warning);
  json["unread"] = report.findings.total(Severity::unread);
  if (source)
    if (const auto stated = stated_accuracy(*source); !stated.empty())
      json["accuracy"] = proto::accuracy_json(stated);
  if (!report.source_note.empty()) json["source_note"] = report.source_note;
  json["findings"] = nlohmann::ordered_json::array();
  for (std::size_t r = 0; r < kCheckRuleCount; ++r) {
    const Findings::Count& found = report.findings[r];
    if (found.count == 0) continue;
    json["findings"].push_back({{"rule", kCheckRules[r].id},
                                {"severity", name_of(kCheckRules[r].severity)},
                                {"demands", kCheckRules[r].demands},
                                {"count", found.count},
                                {"examples", found.examples}});
  }
  json["levels"] = nlohmann::ordered_json::array();
  for (const CheckLevel& level : report.levels) {
    nlohmann::ordered_json l = {
        {"level", level.level},         {"tiles", level.tiles},
        {"triangles", level.triangles}, {"bytes", level.bytes},
        {"budget_m", level.budget_m},   {"stated_max_error_m", level.stated_m},
        {"max_crack_m", level.crack_m}, {"max_gap_to_parent_m", level.gap_m}};
    if (with_source) {
      l["measured_max_error_m"] = level.measured_m;
      l["posts"] = level.posts;
    }
    json["levels"].push_back(std::move(l));
  }
  return json;
}

/// Where there are any, after the other numbers.
std::string unread_text(std::uint64_t unread) {
  return unread > 0 ? fmt::format(", {} could not be read", unread) : "";
}

/// What is wrong is wrong, whatever else could not be read.
int exit_code(std::uint64_t violations, std::uint64_t unread) {
  return violations > 0 ? kBadData : unread > 0 ? kIo : kOk;
}

void print_levels(const CheckReport& report, bool with_source) {
  fmt::print("{:>5} {:>9} {:>11} {:>11} {:>11} {:>11} {:>9} {:>9}\n", "level", "tiles", "triangles",
             "budget m", "stated m", with_source ? "measured m" : "", "crack m", "gap m");
  for (const CheckLevel& l : report.levels)
    fmt::print("{:>5} {:>9} {:>11} {:>11.3f} {:>11.3f} {:>11} {:>9.3g} {:>9.3g}\n", l.level,
               l.tiles, l.triangles, l.budget_m, l.stated_m,
               with_source ? fmt::format("{:.3f}", l.measured_m) : "", l.crack_m, l.gap_m);
}

void print_findings(const CheckReport& report) {
  for (std::size_t r = 0; r < kCheckRuleCount; ++r) {
    const Findings::Count& found = report.findings[r];
    if (found.count == 0) continue;
    fmt::print("\n{} {}, {} times: {}\n", name_of(kCheckRules[r].severity), kCheckRules[r].id,
               found.count, kCheckRules[r].demands);
    for (const std::string& example : found.examples) fmt::print("  {}\n", example);
    if (found.count > found.examples.size()) fmt::print("  ...\n");
  }
  std::uint64_t tiles = 0;
  for (const CheckLevel& level : report.levels) tiles += level.tiles;
  fmt::print("\n{} tiles: {} violations, {} warnings{}\n", tiles,
             report.findings.total(Severity::violation), report.findings.total(Severity::warning),
             unread_text(report.findings.total(Severity::unread)));
  if (!report.source_note.empty()) fmt::print("note: {}\n", logging::printable(report.source_note));
}

/// 3D Tiles, which have no rules of their own: what is wrong is named file by file.
int run_tileset(const Arguments& a, Command app) {
  for (const char* option : {"--levels", "--error-factor"})
    if (app.given(option))
      return complain({Errc::invalid_argument, std::string(option) +
                                                   " is for quantized-mesh tiles, and " + a.where +
                                                   " holds 3D Tiles"});
  if (names_any(a.dem, a.layers))
    return complain({Errc::invalid_argument,
                     "3D Tiles are not compared with a DEM: check the quantized-mesh tiles that "
                     "they were made of"});
  const auto files = TilesetFiles::open(a.where);
  if (!files) return complain(files.error());
  Result<TilesetReport> report = fail(Errc::internal, "not checked");
  {
    ProgressBar bar("check", progress_style(a.progress));
    report = check_tileset(**files, bar.progress());
  }
  if (!report) return complain(report.error());
  if (a.json) {
    const nlohmann::ordered_json j = {{"ok", report->ok()},
                                      {"violations", report->violations},
                                      {"unread", report->unread},
                                      {"contents", report->contents},
                                      {"subtrees", report->subtrees},
                                      {"examples", report->examples},
                                      {"unread_examples", report->unread_examples}};
    std::printf("%s\n", json::to_text(j, 2).c_str());
  } else {
    for (const std::string& example : report->examples)
      fmt::print("violation  {}\n", logging::printable(example));
    if (report->violations > report->examples.size()) fmt::print("...\n");
    for (const std::string& example : report->unread_examples)
      fmt::print("unread     {}\n", logging::printable(example));
    if (report->unread > report->unread_examples.size()) fmt::print("...\n");
    fmt::print("3D Tiles: {} contents, {} subtrees: {} violations{}\n", report->contents,
               report->subtrees, report->violations, unread_text(report->unread));
    if (report->ended_early()) fmt::print("the check ended there\n");
  }
  return exit_code(report->violations, report->unread);
}

int run(Arguments a) {
  if (a.list_rules) {
    print_rules();
    return kOk;
  }
  std::optional<Surface> source;
  if (names_any(a.dem, a.layers)) {
    auto dem = open_surface(a.dem, a.layers);
    if (!dem) return complain(dem.error());
    if (dem->info().crs_kind == CrsKind::none)
      return complain({Errc::unsupported, a.dem.files[0] +
                                              " has no coordinate reference system: tiles cannot "
                                              "be compared with it"});
    const auto shaped = with_shapes(*dem, a.shapes);
    if (!shaped) return complain(shaped.error());
    source.emplace(*shaped);
    a.options.source = source;
  }
  Result<CheckReport> report = fail(Errc::internal, "not checked");
  {
    ProgressBar bar("check", progress_style(a.progress));
    report = check_tiles(a.where, a.options, bar.progress());
  }
  if (!report) return complain(report.error());
  if (a.json) {
    std::printf("%s\n", json::to_text(to_json(*report, source), 2).c_str());
  } else {
    print_levels(*report, source.has_value());
    print_findings(*report);
  }
  return exit_code(report->findings.total(Severity::violation),
                   report->findings.total(Severity::unread));
}

}  // namespace

void add_check(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app =
      program.add_subcommand("check",
                             "Check quantized-mesh tiles, rule by rule, or the files of 3D "
                             "Tiles; anyone's tiles");
  app.add_option(
      "DIR|URL", a->where,
      "a directory with layer.json and z/x/y.terrain, X.pmtiles or X.mbtiles, or where a "
      "server has them (a tind with keys: its key in TIND_KEY); or 3D Tiles: a directory with "
      "tileset.json, or a .3tz");
  app.add_option(
      "--source", a->dem.files,
      "the DEM, or the files of all layers, that the tiles were made of: recompute every "
      "error over all posts");
  a->dem.to_datum = "ellipsoid";  // as tind build has it
  add_dem_options(app, a->dem);
  add_shape_options(app, a->shapes);
  add_layer_options(app, a->layers);
  app.add_option("--error-factor", a->options.error_factor,
                 "budget of a level, times what globe clients assume of it")
      .positive()
      .shown();
  add_levels_option(app, "levels to look at, e.g. 0-8 (default: all)", a->options.first_level,
                    a->options.last_level);
  app.add_option("--threads", a->options.threads,
                 "threads to use, 0: one per core; eight where tiles come from a server")
      .not_negative()
      .shown();
  add_progress_option(app, a->progress);
  app.add_flag("--json", a->json, "print the report as JSON");
  app.add_flag("--rules", a->list_rules, "list the rules and exit");
  app.on_run([a, app, &exit] {
    if (a->where.empty() && !a->list_rules) refuse_missing("DIR|URL");
    exit = !a->list_rules && names_tileset(a->where) ? run_tileset(*a, app) : run(*a);
  });
}

}  // namespace tind::cli
