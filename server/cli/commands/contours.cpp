// tind contours: a DEM's lines of equal height, for a GIS.

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/file_io.h"
#include "terrain/raster/contour_lines.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  ContourOptions options;
  std::string output, progress = "auto";
  bool json = false;
};

int run(const Arguments& a) {
  const auto format = contour_format(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output}, inputs_of(a.dem)); code != kOk) return code;
  const auto dem = open_dem(a.dem);
  if (!dem) return complain(dem.error());
  const auto posts = read_all(**dem);
  if (!posts) return complain(posts.error());
  Result<ContourFile> made;
  {
    ProgressBar bar("contours", progress_style(a.progress));
    made = encode_contours(*format, (*dem)->info(), posts->grid, a.options, bar.progress());
  }
  if (!made) return complain_of(a.dem, made.error());
  if (const auto ok = write_whole_file(a.output, made->bytes); !ok) {
    complain(ok.error());
    return kCannotCreate;
  }
  const DemInfo& info = (*dem)->info();
  if (a.json)
    std::printf("%s\n", json::to_text(nlohmann::ordered_json{{"lines", made->lines},
                                                             {"vertical_datum", name(info.datum)},
                                                             {"input", info.files},
                                                             {"output", a.output}},
                                      2)
                            .c_str());
  else
    fmt::print("{}: {} lines\n", a.output, made->lines);
  return kOk;
}

}  // namespace

void add_contours(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand("contours", "Lines of equal height of a DEM");
  app.add_option("input", a->dem.files, "a DEM, or several that share one grid").required();
  app.add_option("-o,--output", a->output, "the lines: .gpkg, .fgb, .geojson or .json").required();
  Command which = app.add_group("At which heights (exactly one)", 1, 1);
  which.add_option("--interval", a->options.interval_m, "so many metres apart").positive();
  which.add_option("--levels", a->options.levels, "at these: 100,250,500").delimiter(',');
  app.add_option("--base", a->options.base_m, "one of the heights of --interval, metres").shown();
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_json_flag(app, a->json);
  add_progress_option(app, a->progress);
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
