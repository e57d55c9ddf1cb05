// tind viewshed: what can be seen from a place, as a raster.

#include "terrain/analysis/viewshed.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "server/cli/commands/commands.h"
#include "server/cli/options/level_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/place_input.h"
#include "server/cli/options/raster_output.h"
#include "server/cli/options/report_output.h"
#include "server/cli/options/sight_input.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/raster/raster_file.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  LevelInput level;
  SightInput sight;
  std::string from, crs = "CRS84", output, progress = "auto";
  double from_height_m = 1.7, to_height_m = 0;
  std::optional<double> radius_m;
  int threads = 0;
  ReportOutput report;
};

struct Made {
  std::shared_ptr<const DemSource> dem;  // what was looked over
  Viewshed seen;
  double uncertainty_m = 0;
};

Result<Made> make(const Arguments& a) {
  const auto asked = open_asked(a.dem, a.level);
  if (!asked) return std::unexpected(asked.error());
  const GeoRect& b = asked->dem->info().bounds;
  const auto from =
      read_place(a.from, "--from", a.crs, {(b.west + b.east) / 2, (b.south + b.north) / 2});
  if (!from) return std::unexpected(from.error());
  ViewshedOptions options{{*from, a.from_height_m}, a.to_height_m};
  options.rules.refraction = a.sight.refraction, options.threads = a.threads;
  if (a.radius_m) options.radius_m = *a.radius_m;
  auto dem = dem_around(asked->dem, options);
  if (!dem) return std::unexpected(dem.error());
  const auto posts = read_all(**dem);  // of tiles this tells how far they are off
  if (!posts) return std::unexpected(posts.error());
  const auto uncertainty =
      uncertainty_of(a.sight, (*dem)->info(), asked->level ? asked->level->max_error_m() : 0);
  if (!uncertainty) return std::unexpected(uncertainty.error());
  options.rules.uncertainty_m = *uncertainty, options.rules.anywhere_m = asked->tin_error_m;
  ProgressBar bar("viewshed", progress_style(a.progress));
  auto seen = viewshed(**dem, posts->grid, options, bar.progress());
  if (!seen) return std::unexpected(seen.error());
  return Made{std::move(*dem), std::move(*seen), options.rules.all_m()};
}

Result<void> put(const Arguments& a, RasterFormat format, const Made& made) {
  const auto rows = [&](int row, int count) -> Result<HeightGrid> {
    HeightGrid strip(made.seen.visibility.cols(), count);
    for (int r = 0; r < count; ++r)
      std::ranges::copy(made.seen.visibility.row(row + r), strip.row(r).begin());
    return strip;
  };
  const auto bytes = encode_raster(format, made.dem->info(), viewshed_contents(), rows);
  if (!bytes) return std::unexpected(bytes.error());
  return write_raster(a.output, *bytes);
}

int run(const Arguments& a) {
  const auto format = raster_format(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output, a.report.path}, inputs_of(a.dem)); code != kOk)
    return code;
  const auto made = make(a);
  if (!made) return complain_of(a.dem, made.error());
  if (const auto ok = put(a, *format, *made); !ok) return complain(ok.error());
  const Viewshed& v = made->seen;
  const DemInfo& info = made->dem->info();
  const nlohmann::ordered_json report = {{"cols", info.cols},
                                         {"rows", info.rows},
                                         {"visible", v.visible},
                                         {"hidden", v.hidden},
                                         {"depends", v.depends},
                                         {"refraction", a.sight.refraction},
                                         {"uncertainty_m", made->uncertainty_m},
                                         {"input", info.files},
                                         {"output", a.output}};
  return put_report(a.report, report, [&] {
    fmt::print("{}: {} x {} posts; {} visible, {} hidden, {} depend\n", a.output, info.cols,
               info.rows, v.visible, v.hidden, v.depends);
  });
}

}  // namespace

void add_viewshed(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  a->dem.to_datum = "ellipsoid";  // rays are straight above that
  Command app = program.add_subcommand(
      "viewshed", "What can be seen from a place, as a raster: 0 hidden, 1 visible, 2 depends");
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("-o,--output", a->output, "the raster: .tif, or .asc with a .prj").required();
  app.add_option("--from", a->from, "where the observer stands: X,Y").required();
  add_places_crs(app, a->crs);
  app.add_option("--from-height", a->from_height_m,
                 "of the observer's eye above the ground, metres")
      .range(0., 1e5)
      .shown();
  app.add_option("--to-height", a->to_height_m, "of what is looked for above the ground, metres")
      .range(0., 1e5)
      .shown();
  app.add_option("--radius", a->radius_m, "no farther than so many metres").positive();
  add_sight_options(app, a->sight);
  add_level_options(app, a->level);
  app.add_option("--threads", a->threads, "0: one a core").range(0, 1024).shown();
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_report_options(app, a->report);
  add_progress_option(app, a->progress);
  app.footer("Example: tind viewshed alps.tif --from 7.60,45.97 --radius 20000 -o seen.tif");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
