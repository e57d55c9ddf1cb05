// tind difference: one DEM less another, as a raster on the first one's grid, with its statistics.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/raster_output.h"
#include "server/cli/options/report_output.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/analysis/volume.h"
#include "terrain/raster/raster_file.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  std::vector<std::string> less;
  std::string output, progress = "auto";
  ReportOutput report;
};

/// Of the posts that both have; mean and deviation as they come [Welford 1962].
struct Differences {
  std::size_t posts = 0, without = 0;
  double min_m = std::numeric_limits<double>::infinity(), max_m = -min_m;
  double mean_m = 0, squares = 0, sum_squares = 0;

  void take(double d) {
    if (std::isnan(d)) {
      ++without;
      return;
    }
    min_m = std::min(min_m, d), max_m = std::max(max_m, d);
    const double off = d - mean_m;
    mean_m += off / double(++posts);
    squares += off * (d - mean_m);
    sum_squares += d * d;
  }
};

nlohmann::ordered_json to_json(const Arguments& a, const DemInfo& info, const Differences& d) {
  nlohmann::ordered_json j = {
      {"cols", info.cols}, {"rows", info.rows}, {"posts", d.posts}, {"without", d.without}};
  if (d.posts > 0) {
    const double n = double(d.posts);
    j["min_m"] = d.min_m, j["max_m"] = d.max_m, j["mean_m"] = d.mean_m;
    j["std_m"] = std::sqrt(d.squares / n), j["rms_m"] = std::sqrt(d.sum_squares / n);
  }
  j["input"] = info.files, j["less"] = a.less, j["output"] = a.output;
  return j;
}

struct Made {
  std::shared_ptr<const DemSource> dem;
  RasterBytes raster;
  Differences differences;
};

Result<Made> make(const Arguments& a, RasterFormat format) {
  Made made;
  const TwoDems two = two_dems(a.dem, a.less);
  auto dem = open_dem(two.first);
  if (!dem) return std::unexpected(dem.error());
  made.dem = std::move(*dem);
  if (auto ok = can_lie_there(a.output, made.dem->info()); !ok) return std::unexpected(ok.error());
  auto less = open_dem(two.other);
  if (!less) return std::unexpected(less.error());
  warn_of_datums(made.dem->info(), (*less)->info());
  const auto difference = difference_rows(*made.dem, DemReference{std::move(*less)});
  if (!difference) return std::unexpected(difference.error());
  const DemInfo& info = made.dem->info();
  ProgressBar bar("difference", progress_style(a.progress));
  std::vector<double> line(std::size_t(info.cols));
  const auto rows = [&](int row, int count) -> Result<HeightGrid> {
    HeightGrid out(int(info.cols), count);
    for (int r = 0; r < count; ++r) {
      if (auto ok = (*difference)(row + r, line); !ok) return std::unexpected(ok.error());
      for (int c = 0; c < out.cols(); ++c) {
        made.differences.take(line[std::size_t(c)]);
        out.at(c, r) = float(line[std::size_t(c)]);
      }
    }
    bar.at(double(row + count) / double(info.rows));
    return out;
  };
  auto raster =
      encode_raster(format, info, {.heights = false, .what = "difference of heights"}, rows);
  if (!raster) return std::unexpected(raster.error());
  if (made.differences.posts == 0)
    return fail(Errc::bad_data, "has a height at no place where the DEM that is taken off has one");
  made.raster = std::move(*raster);
  return made;
}

int run(const Arguments& a) {
  const auto format = raster_format(a.output);
  if (!format) return complain(format.error());
  const std::vector<std::string> inputs = inputs_of(a.dem, a.less);
  if (const int code = check_outputs({a.output, a.report.path}, inputs); code != kOk) return code;
  const auto made = make(a, *format);
  if (!made) return complain_of(a.dem, made.error());
  if (const auto ok = write_raster(a.output, made->raster); !ok) return complain(ok.error());
  const Differences& d = made->differences;
  return put_report(a.report, to_json(a, made->dem->info(), d), [&] {
    fmt::print("{}: {} posts, {} without a difference\n", a.output, d.posts, d.without);
    fmt::print("from {:.3f} to {:.3f} m, mean {:.3f}, deviation {:.3f}, RMS {:.3f}\n", d.min_m,
               d.max_m, d.mean_m, std::sqrt(d.squares / double(d.posts)),
               std::sqrt(d.sum_squares / double(d.posts)));
  });
}

}  // namespace

void add_difference(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "difference", "One DEM less another: a raster on the first one's grid, and its statistics");
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("--less", a->less,
                 "the DEM or TIN that is taken off, on any grid; opened as the first is")
      .required();
  app.add_option("-o,--output", a->output, "the raster: .tif, or .asc with a .prj").required();
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_report_options(app, a->report);
  add_progress_option(app, a->progress);
  app.footer("Example: tind difference 2024.tif --less 2014.tif -o change.tif");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
