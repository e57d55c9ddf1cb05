// tind profile: heights along a line, of a DEM or of what clients of a level of tiles see.

#include "terrain/analysis/profile.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/level_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/place_input.h"
#include "server/cli/options/profile_output.h"
#include "server/cli/options/tin_input.h"
#include "terrain/base/file_io.h"
#include "terrain/raster/datums.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  LevelInput level;
  std::string line, crs = "CRS84", output, format;
  std::int64_t samples = 0;
  double step_m = 0;
  bool json = false;
};

bool is_sampled(const Arguments& a) { return a.samples > 0 || a.step_m > 0; }

Result<GeodesicPath> path_of(const Arguments& a, const GeoRect& where) {
  const auto places = read_places(a.line, "--line", a.crs,
                                  {(where.west + where.east) / 2, (where.south + where.north) / 2});
  if (!places) return std::unexpected(places.error());
  GeodesicPath path(*places);
  if (!(path.length_m() > 0))
    return fail(Errc::invalid_argument, "--line needs at least two places, not all the same");
  const double points = a.samples > 0 ? double(a.samples) : path.length_m() / a.step_m;
  if (is_sampled(a) && points > double(kMostProfilePoints))
    return fail(Errc::out_of_range,
                "a profile has at most a million heights: take a longer --step");
  return path;
}

std::vector<double> distances_of(const Arguments& a, double length_m) {
  return a.samples > 0 ? even_distances(length_m, std::size_t(a.samples))
                       : stepped_distances(length_m, a.step_m);
}

struct Made {
  Profile profile;
  ProfileFacts facts;
};

/// Of tiles alone, as clients draw them.
Result<Made> of_tiles(const Arguments& a) {
  if (!is_sampled(a))
    return fail(Errc::invalid_argument,
                "of tiles without their DEM a profile has --samples or --step: name the DEM, too, "
                "for one that is exact");
  const auto tiles = open_level_tiles(a.level);
  if (!tiles) return std::unexpected(tiles.error());
  const auto path = path_of(a, {-180, -90, 180, 90});
  if (!path) return std::unexpected(path.error());
  Made made{{path->length_m(), {}}, {name(datum_of(**tiles)), {}, true}};
  std::vector<Geographic> places;
  for (const double metres : distances_of(a, path->length_m())) {
    places.push_back(path->at(metres));
    made.profile.points.push_back({metres, places.back(), {}});
  }
  const auto heights = level_heights(level_tiles_of(**tiles), places, a.level.level);
  if (!heights) return std::unexpected(heights.error());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& height = (*heights)[i];
    if (!height) continue;
    made.profile.points[i].height = {Coverage::value, height->height_m};
    if (height->max_error_m)
      made.facts.bound_m = std::max(made.facts.bound_m.value_or(0), *height->max_error_m);
  }
  return made;
}

/// Of a TIN itself: exact.
Result<Made> of_tin(const Arguments& a) {
  const auto ground = open_tin_ground(a.dem);
  if (!ground) return std::unexpected(ground.error());
  const DemInfo& info = ground->frame->info();
  const auto path = path_of(a, info.bounds);
  if (!path) return std::unexpected(path.error());
  auto profile = is_sampled(a) ? sampled_profile(*ground, *path, distances_of(a, path->length_m()))
                               : exact_profile(*ground, *path);
  if (!profile) return std::unexpected(profile.error());
  return Made{std::move(*profile), {name(info.datum), {}, false}};
}

Result<Made> of_dem(const Arguments& a) {
  const auto asked = open_asked(a.dem, a.level);
  if (!asked) return std::unexpected(asked.error());
  const DemInfo& info = asked->dem->info();
  const auto path = path_of(a, info.bounds);
  if (!path) return std::unexpected(path.error());
  auto profile = is_sampled(a)
                     ? sampled_profile(*asked->dem, *path, distances_of(a, path->length_m()))
                     : exact_profile(*asked->dem, *path);
  if (!profile) return std::unexpected(profile.error());
  Made made{std::move(*profile), {name(info.datum), {}, false}};
  if (asked->level || asked->tin) made.facts.bound_m = asked->error_m();
  return made;
}

int run(const Arguments& a) {
  // Without a file the profile itself is what is printed.
  Result<ProfileFormat> format =
      a.json && a.output.empty() ? ProfileFormat::json : ProfileFormat::csv;
  if (a.json && a.output.empty() && !a.format.empty() && a.format != "json")
    return complain(
        {Errc::invalid_argument, "--json prints the profile as JSON, and --format says " +
                                     a.format + ": leave one of them out, or name a file with -o"});
  if (!a.format.empty())
    format = *enum_named<ProfileFormat>(a.format);
  else if (!a.output.empty())
    format = profile_format(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output}, inputs_of(a.dem)); code != kOk) return code;
  if (a.dem.files.empty() && a.level.tiles.empty())
    return complain(
        {Errc::invalid_argument, "a profile is of a DEM or a TIN, or of --tiles: name one"});
  const bool tin = a.level.tiles.empty() && asks_tin_itself(a.dem);
  const auto made = a.dem.files.empty() ? of_tiles(a) : tin ? of_tin(a) : of_dem(a);
  if (!made) return complain_of(a.dem, made.error());
  const std::string text = profile_text(*format, made->profile, made->facts);
  if (a.output.empty()) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return kOk;
  }
  if (const auto ok = write_whole_file(a.output, text); !ok) return complain(ok.error());
  const auto summary = profile_summary(a.output, made->profile, made->facts);
  fmt::print("{}", a.json ? json::to_text(summary, 2) + "\n" : profile_summary_line(summary));
  return kOk;
}

}  // namespace

void add_profile(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "profile", "Heights along a line: sampled, or wherever the surface turns");
  app.add_option("input", a->dem.files,
                 dem_or_tin_help() + "; without --posts the TIN itself is asked, exactly");
  app.add_option("--line", a->line, "\"X,Y X,Y ...\", geodesics between them").required();
  add_places_crs(app, a->crs);
  Command how = app.add_group("Where (at most one; else wherever the surface turns)", 0, 1);
  how.add_option("--samples", a->samples, "so many heights at equal distances")
      .range(std::int64_t(2), std::int64_t(kMostProfilePoints));
  how.add_option("--step", a->step_m, "a height every so many metres, and at the end").positive();
  app.add_option("-o,--output", a->output,
                 ".csv, .geojson, .json or .covjson; without it CSV on standard output");
  app.add_option("--format", a->format, "in place of the extension's")
      .one_of(enum_names<ProfileFormat>());
  add_level_options(app, a->level);
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_json_flag(app, a->json);
  app.footer("Example: tind profile alps.tif --line \"7.60,45.97 7.74,46.03\" -o ridge.csv");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
