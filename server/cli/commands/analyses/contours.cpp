// tind contours: a DEM's lines of equal height, for a GIS; or the areas between which they must
// lie, when a mesh or tiles are all that one has.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/level_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/analysis/contour_bands.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_raster.h"
#include "terrain/raster/contour_lines.h"
#include "terrain/simplify/simplify.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  LevelInput tiles;
  ContourOptions options;
  std::string output, progress = "auto";
  bool band = false, json = false;
  std::optional<double> max_error_m;
};

/// A file, and what is said of it.
struct Made {
  ContourFile file;
  DemInfo info;
  nlohmann::ordered_json report;
  std::string text;
};

/// What is known of the terrain: its heights at posts, and how wrong they are.
struct Known {
  HeightGrid posts;
  double error_m = 0;
  std::size_t triangles = 0;
};

/// How much a mesh within an error of the posts moves where its heights become floats, at most.
double rounding_of(const HeightGrid& posts, double error_m) {
  double highest = 0;
  for (const float z : posts.values())
    if (!std::isnan(z)) highest = std::max(highest, std::abs(double(z)));
  const auto top = float(highest + error_m);
  return (double(std::nextafter(top, HUGE_VALF)) - double(top)) / 2;
}

/// A mesh with as few triangles as the error allows, and what that is of its heights as floats.
Result<Known> simplified(const Terrain& dem, double max_error_m, const Progress& progress) {
  SimplifyOptions options;
  const double rounding = rounding_of(dem.grid, max_error_m);
  options.stop.max_error_m = max_error_m > rounding ? max_error_m - rounding : max_error_m;
  const auto made = simplify(dem, options, progress);
  if (!made) return std::unexpected(made.error());
  MeshRaster seen = mesh_raster(made->tin, dem.grid, 0);
  double error = 0;
  for (std::size_t i = 0; i < seen.heights.size(); ++i) {
    float& z = seen.heights.values()[i];
    if (std::isnan(seen.errors.values()[i])) z = HeightGrid::kVoid;  // nobody says how wrong it is
    if (!std::isnan(z)) error = std::max(error, std::abs(double(z) - double(dem.grid.values()[i])));
  }
  return Known{std::move(seen.heights), error, made->tin.triangles.size()};
}

Result<Made> make_bands(const Arguments& a, ContourFormat format) {
  ProgressBar bar("contours", progress_style(a.progress));
  const Progress progress = bar.progress();
  const Progress first = progress.part(0, 0.7), second = progress.part(0.7, 1);
  const auto asked = open_asked(a.dem, a.tiles);
  if (!asked) return std::unexpected(asked.error());
  auto posts = read_all(*asked->dem);
  if (!posts) return std::unexpected(posts.error());
  Result<Known> known = a.max_error_m
                            ? simplified(*posts, *a.max_error_m, first)
                            : Result<Known>({std::move(posts->grid), asked->error_m(), 0});
  if (!known) return std::unexpected(known.error());
  if (a.max_error_m) known->error_m += asked->error_m();
  const BoundedSurface surface = bounded_surface(known->posts, known->error_m);
  if (surface.mesh.triangles.empty())
    return fail(Errc::bad_data, "no three posts beside each other have a height");
  const auto heights =
      contour_heights(a.options, std::ranges::min(surface.low), std::ranges::max(surface.high));
  if (!heights) return std::unexpected(heights.error());
  const auto areas = contour_bands(surface, *heights, second);
  if (!areas) return std::unexpected(areas.error());
  const DemInfo& info = asked->dem->info();
  auto file = encode_contour_areas(format, info, *areas, known->error_m);
  if (!file) return std::unexpected(file.error());
  Made made{std::move(*file), info, {}, {}};
  made.report = {{"areas", areas->size()}, {"error_m", known->error_m}};
  if (known->triangles > 0) made.report["triangles"] = known->triangles;
  made.text = fmt::format("{} areas; heights are within {:.3f} m", areas->size(), known->error_m);
  return made;
}

Result<Made> make_lines(const Arguments& a, ContourFormat format) {
  const auto dem = open_dem(a.dem);
  if (!dem) return std::unexpected(dem.error());
  const auto posts = read_all(**dem);
  if (!posts) return std::unexpected(posts.error());
  ProgressBar bar("contours", progress_style(a.progress));
  auto file = encode_contours(format, (*dem)->info(), posts->grid, a.options, bar.progress());
  if (!file) return std::unexpected(file.error());
  Made made{std::move(*file), (*dem)->info(), {}, {}};
  made.report = {{"lines", made.file.lines}};
  made.text = fmt::format("{} lines", made.file.lines);
  return made;
}

int run(const Arguments& a) {
  const auto format = contour_format(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output}, inputs_of(a.dem)); code != kOk) return code;
  Result<Made> made = a.band ? make_bands(a, *format) : make_lines(a, *format);
  if (!made) return complain_of(a.dem, made.error());
  if (const auto ok = write_whole_file(a.output, made->file.bytes); !ok)
    return complain(ok.error());
  made->report["vertical_datum"] = name(made->info.datum);
  made->report["input"] = made->info.files;
  made->report["output"] = a.output;
  if (a.json)
    std::printf("%s\n", json::to_text(made->report, 2).c_str());
  else
    fmt::print("{}: {}\n", a.output, made->text);
  return kOk;
}

}  // namespace

void add_contours(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "contours", "Lines of equal height of a DEM, or areas in which they certainly lie");
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("-o,--output", a->output, "the lines: .gpkg, .fgb, .geojson or .json").required();
  Command which = app.add_group("At which heights (exactly one)", 1, 1);
  which.add_option("--interval", a->options.interval_m, "so many metres apart").positive();
  which.add_option("--levels", a->options.levels, "at these: 100,250,500").delimiter(',');
  app.add_option("--base", a->options.base_m, "one of the heights of --interval, metres").shown();
  app.add_flag(
      "--as-band", a->band,
      "areas in place of lines: where the DEM can have the height, when all that is known "
      "of it is a mesh (--max-error), a level of tiles (--tiles) or a TIN's posts, and how wrong "
      "that is");
  app.add_option(
         "--max-error", a->max_error_m,
         "--as-band: of a mesh with as few triangles as keep every post within so many metres")
      .positive();
  add_level_options(app, a->tiles);
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_json_flag(app, a->json);
  add_progress_option(app, a->progress);
  app.on_run([a, app, &exit] {
    const bool mesh = a->max_error_m.has_value(), tiles = !a->tiles.tiles.empty();
    const bool tin = !a->dem.files.empty() && is_mesh(a->dem.files[0]);
    const bool known = mesh != tiles || (tin && !mesh);
    if (!a->options.levels.empty() && app.given("--base"))
      refuse_value("--base", "is for --interval");
    if (a->band && !known) refuse_missing("--max-error or --tiles, one of them, for --as-band");
    if (!a->band && mesh) refuse_value("--max-error", "is for --as-band");
    if (!a->band && tiles) refuse_value("--tiles", "is for --as-band");
    exit = run(*a);
  });
}

}  // namespace tind::cli
