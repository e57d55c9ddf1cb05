// tind slope, aspect, hillshade, roughness, tri, tpi: what a DEM's neighbourhoods say, as a raster.

#include "terrain/analysis/derivatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/plane_scale.h"
#include "server/cli/options/raster_output.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/surface/any_height.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  DerivativeOptions options;
  std::string output, progress = "auto";
  bool json = false;
};

struct Row {
  Derivative kind;
  const char* help;
};
constexpr Row kRows[] = {
    {Derivative::slope, "Slope of a DEM as a raster: degrees, or per cent"},
    {Derivative::aspect,
     "Where a DEM's slopes face, as a raster: degrees clockwise from north, of a projected DEM "
     "from the north of its grid"},
    {Derivative::hillshade, "A DEM lit from a side, as a raster of greys"},
    {Derivative::roughness, "The largest difference of heights around each post, as a raster"},
    {Derivative::tri, "Terrain ruggedness index (Riley) as a raster"},
    {Derivative::tpi, "Topographic position index as a raster"},
};

bool is_of_lengths(Derivative kind) {
  return kind == Derivative::slope || kind == Derivative::hillshade;
}

/// Of those that are computed of distances: the others are of heights alone.
void warn_of_scale(Derivative kind, const LengthScale& scale, const DemInfo& info) {
  if (is_of_lengths(kind))
    warn_of_lengths(scale, info, kind == Derivative::slope ? "slopes are" : "light and shade are");
  if (kind == Derivative::aspect) warn_of_directions(scale, info);
}

/// What is void all over is an answer only where there are heights: flat land has no aspect.
Result<void> expect_any(const DemSource& dem, Derivative kind) {
  if (kind != Derivative::aspect) return std::unexpected(no_heights());
  const auto any = any_height(Surface(dem));
  if (!any) return std::unexpected(any.error());
  if (!*any) return std::unexpected(no_heights());
  return {};
}

int run(const Arguments& a) {
  const auto format = raster_format(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output}, inputs_of(a.dem)); code != kOk) return code;
  const auto dem = open_dem(a.dem);
  if (!dem) return complain(dem.error());
  if (const auto ok = can_lie_there(a.output, (*dem)->info()); !ok) return complain(ok.error());
  bool any = false;
  const auto watched = [&any](RasterRows rows) -> RasterRows {
    return [&any, rows = std::move(rows)](int row, int count) {
      auto made = rows(row, count);
      if (made && !any)
        any = !std::ranges::all_of(made->values(), [](float v) { return std::isnan(v); });
      return made;
    };
  };
  Result<RasterBytes> made;
  {
    ProgressBar bar(name_of(a.options.kind), progress_style(a.progress));
    made = encode_raster(*format, (*dem)->info(), contents_of(a.options),
                         watched(derivative_rows(**dem, a.options, bar.progress())));
  }
  if (!made) return complain_of(a.dem, made.error());
  if (!any)
    if (const auto ok = expect_any(**dem, a.options.kind); !ok)
      return complain_of(a.dem, ok.error());
  warn_of_nodata(**dem);
  if (const auto ok = write_raster(a.output, *made); !ok) return complain(ok.error());
  const DemInfo& info = (*dem)->info();
  const LengthScale scale = length_scale(**dem);
  warn_of_scale(a.options.kind, scale, info);
  if (!a.json) {
    fmt::print("{}: {} x {} posts\n", a.output, info.cols, info.rows);
    return kOk;
  }
  nlohmann::ordered_json report = {
      {"derivative", name_of(a.options.kind)}, {"cols", info.cols}, {"rows", info.rows}};
  if (is_of_lengths(a.options.kind) || a.options.kind == Derivative::aspect)
    report["length_scale"] = length_scale_json(scale);
  report["input"] = info.files;
  report["output"] = a.output;
  std::printf("%s\n", json::to_text(report, 2).c_str());
  return kOk;
}

void add_one(Command program, int& exit, const Row& row) {
  auto a = std::make_shared<Arguments>();
  a->options.kind = row.kind;
  Command app = program.add_subcommand(name_of(row.kind), row.help);
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("-o,--output", a->output, "the raster: .tif, or .asc with a .prj").required();
  if (row.kind == Derivative::slope)
    app.add_flag("--percent", a->options.percent, "per cent in place of degrees");
  if (row.kind == Derivative::hillshade) {
    Shade& light = a->options.light;
    app.add_option("--azimuth", light.azimuth_deg,
                   "where the light comes from, degrees clockwise from north")
        .range(0., 360.)
        .shown();
    app.add_option("--altitude", light.altitude_deg, "of the light above the horizon, degrees")
        .range(0., 90.)
        .shown();
    app.add_option("--z-factor", light.z_factor, "by which heights are multiplied")
        .positive()
        .shown();
  }
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_json_flag(app, a->json);
  add_progress_option(app, a->progress);
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace

void add_derivatives(Command program, int& exit) {
  for (const Row& row : kRows) add_one(program, exit, row);
}

}  // namespace tind::cli
