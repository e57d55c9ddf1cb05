// tind line-of-sight: does one place see another, and by how much?

#include "terrain/analysis/line_of_sight.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/cli/commands/commands.h"
#include "server/cli/options/level_input.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/place_input.h"
#include "server/cli/options/report_output.h"
#include "server/cli/options/sight_input.h"
#include "server/cli/options/tin_input.h"
#include "terrain/raster/datums.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  LevelInput level;
  SightInput sight;
  std::string from, to, crs = "CRS84";
  double from_height_m = 1.7, to_height_m = 0;
  ReportOutput report;
};

struct Answer {
  LineOfSight line;
  SightEnd from, to;
  double uncertainty_m = 0;
  std::string datum;
};

Result<Answer> answer(const Arguments& a) {
  const auto asked = open_asked(a.dem, a.level);
  if (!asked) return std::unexpected(asked.error());
  const DemInfo& info = asked->dem->info();
  const GeoRect& b = info.bounds;
  const Geographic middle{(b.west + b.east) / 2, (b.south + b.north) / 2};
  const auto from = read_place(a.from, "--from", a.crs, middle);
  if (!from) return std::unexpected(from.error());
  const auto to = read_place(a.to, "--to", a.crs, middle);
  if (!to) return std::unexpected(to.error());
  Answer out{{}, {*from, a.from_height_m}, {*to, a.to_height_m}, 0, name(info.datum)};
  SightRules rules{.refraction = a.sight.refraction};
  // Of tiles the first time tells how far they are off: those that the ray crosses.
  for (int time = 0; time < (asked->level ? 2 : 1); ++time) {
    const auto uncertainty =
        uncertainty_of(a.sight, info, asked->level ? asked->level->max_error_m() : 0);
    if (!uncertainty) return std::unexpected(uncertainty.error());
    rules.uncertainty_m = *uncertainty, rules.anywhere_m = asked->tin_error_m;
    out.uncertainty_m = rules.all_m();
    auto line = line_of_sight(*asked->dem, out.from, out.to, rules);
    if (!line) return std::unexpected(line.error());
    out.line = *line;
  }
  return out;
}

nlohmann::ordered_json to_json(const Arguments& a, const Answer& answer) {
  const LineOfSight& l = answer.line;
  nlohmann::ordered_json j = {{"visibility", name_of(l.visibility)},
                              {"length_m", l.length_m},
                              {"observer_m", l.eye_m},
                              {"target_m", l.target_m},
                              {"datum", answer.datum},
                              {"refraction", a.sight.refraction},
                              {"uncertainty_m", answer.uncertainty_m}};
  if (l.nearest)
    j["nearest"] = {{"lon", l.nearest->place.lon},
                    {"lat", l.nearest->place.lat},
                    {"distance_m", l.nearest->share * l.length_m},
                    {"ground_m", l.nearest->ground_m},
                    {"clearance_m", l.nearest->clearance_m}};
  j["first_hidden_m"] = l.first_hidden_share
                            ? nlohmann::ordered_json(*l.first_hidden_share * l.length_m)
                            : nlohmann::ordered_json();
  if (l.surely_m) j["clearance_within_m"] = {*l.surely_m, *l.perhaps_m};
  j["unknown_ground"] = l.unknown;
  return j;
}

void print(const Answer& answer) {
  const LineOfSight& l = answer.line;
  const bool open = answer.uncertainty_m > 0;
  fmt::print("{}{} over {:.3f} km, from {:.2f} m to {:.2f} m ({})\n", name_of(l.visibility),
             l.visibility == Visibility::depends
                 ? (open ? " on what is within the uncertainty" : " on what is unknown")
             : open ? " for certain"
                    : "",
             l.length_m / 1000, l.eye_m, l.target_m, answer.datum);
  if (l.nearest)
    fmt::print("the ray is {:.2f} m {} the ground ({:.2f} m) at {:.7f},{:.7f}, {:.3f} km away\n",
               std::abs(l.nearest->clearance_m), l.nearest->clearance_m < 0 ? "below" : "above",
               l.nearest->ground_m, l.nearest->place.lon, l.nearest->place.lat,
               l.nearest->share * l.length_m / 1000);
  if (l.first_hidden_share)
    fmt::print("it first meets the ground after {:.3f} km\n",
               *l.first_hidden_share * l.length_m / 1000);
  if (l.surely_m)
    fmt::print("with heights within {:.3g} m of these, clearance is between {:.2f} and {:.2f} m\n",
               answer.uncertainty_m, *l.surely_m, *l.perhaps_m);
  if (l.unknown) fmt::print("part of the ground below is void or beyond the DEM\n");
}

int run(const Arguments& a) {
  if (const int code = check_outputs({a.report.path}, inputs_of(a.dem)); code != kOk) return code;
  const auto found = answer(a);
  if (!found) return complain_of(a.dem, found.error());
  return put_report(a.report, to_json(a, *found), [&] { print(*found); });
}

}  // namespace

void add_line_of_sight(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  a->dem.to_datum = "ellipsoid";  // a ray is straight above that
  Command app = program.add_subcommand("line-of-sight",
                                       "Whether one place sees another, and what stands between");
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("--from", a->from, "where the observer stands: X,Y").required();
  app.add_option("--to", a->to, "where the target stands: X,Y").required();
  add_places_crs(app, a->crs);
  app.add_option("--from-height", a->from_height_m,
                 "of the observer's eye above the ground, metres")
      .range(0., 1e5)
      .shown();
  app.add_option("--to-height", a->to_height_m, "of the target above the ground, metres")
      .range(0., 1e5)
      .shown();
  add_sight_options(app, a->sight);
  add_level_options(app, a->level);
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_report_options(app, a->report);
  app.footer(
      "Example: tind line-of-sight alps.tif --from 7.60,45.97 --to 7.74,46.03 --to-height 20");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
