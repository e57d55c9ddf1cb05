// tind relief: a DEM's heights as colours in the light of a hillshade, as a picture.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/image/png.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/output_turn.h"
#include "server/cli/options/plane_scale.h"
#include "server/cli/options/report_output.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/pictures/colours.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/analysis/derivatives.h"
#include "terrain/base/file_io.h"
#include "terrain/base/lower_extension.h"
#include "terrain/raster/picture_file.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  DerivativeOptions shade{.kind = Derivative::hillshade};
  std::optional<double> low_m, high_m;
  std::string output, progress = "auto";
  ReportOutput report;
};

enum class Format { png, tiff };

Result<Format> format_of(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".png") return Format::png;
  if (extension == ".tif" || extension == ".tiff") return Format::tiff;
  return fail(Errc::invalid_argument,
              "cannot tell the format of the picture " + path + ": name it .png or .tif");
}

/// What the first and the last colour are for.
struct Range {
  double low = 0, high = 0;
  double share(double z) const { return high > low ? (z - low) / (high - low) : 0.5; }
};

/// As said, else the lowest and highest post.
Result<Range> range_of(const Arguments& a, const HeightGrid& posts) {
  Range range{HUGE_VAL, -HUGE_VAL};
  for (const float z : posts.values())
    if (!std::isnan(z)) range = {std::min<double>(range.low, z), std::max<double>(range.high, z)};
  if (!(range.low <= range.high)) return std::unexpected(no_heights());
  return Range{a.low_m.value_or(range.low), a.high_m.value_or(range.high)};
}

/// The viewer's colours of land (server/viewer/globe/material.js), from the lowest to the highest.
Pixel colour_at(double share) {
  struct Stop {
    double at;
    Pixel colour;
  };
  constexpr Stop kStops[] = {{0, {127, 154, 118}},    {0.25, {168, 181, 138}},
                             {0.5, {203, 191, 155}},  {0.72, {195, 182, 168}},
                             {0.86, {228, 226, 222}}, {1, {251, 252, 253}}};
  const double t = std::clamp(share, 0.0, 1.0);
  std::size_t i = 1;
  while (kStops[i].at < t) ++i;
  const Stop &a = kStops[i - 1], &b = kStops[i];
  return mix(a.colour, b.colour, (t - a.at) / (b.at - a.at));
}

/// Transparent where there is no post.
std::vector<std::uint8_t> colours(const HeightGrid& posts, int row, const HeightGrid& light,
                                  const Range& range) {
  std::vector<std::uint8_t> out;
  out.reserve(std::size_t(4) * light.size());
  for (int r = 0; r < light.rows(); ++r)
    for (int c = 0; c < light.cols(); ++c) {
      if (light.is_void(c, r)) {
        out.insert(out.end(), 4, 0);
        continue;
      }
      const Pixel p = lit(colour_at(range.share(posts.at(c, row + r))), light.at(c, r) / 255.0);
      out.insert(out.end(), {p[0], p[1], p[2], 255});
    }
  return out;
}

/// ESRI's six lines that say where a picture lies.
std::string world_file(const DemInfo& info) {
  const Affine& a = info.post_to_crs;
  return fmt::format("{:.17g}\n{:.17g}\n{:.17g}\n{:.17g}\n{:.17g}\n{:.17g}\n", a.x_col, a.y_col,
                     a.x_row, a.y_row, a.x0, a.y0);
}

Result<std::string> encode(Format format, const DemInfo& info, const PictureRows& rows) {
  if (format == Format::tiff) return encode_picture_tiff(info, rows);
  const auto samples = rows(0, int(info.rows));
  if (!samples) return std::unexpected(samples.error());
  return proto::encode_png(int(info.cols), int(info.rows), 4, *samples);
}

int run(const Arguments& a) {
  const auto format = format_of(a.output);
  if (!format) return complain(format.error());
  const std::string world = *format == Format::png
                                ? std::filesystem::path(a.output).replace_extension(".pgw").string()
                                : "";
  if (const int code = check_outputs({a.output, world, a.report.path}, inputs_of(a.dem));
      code != kOk)
    return code;
  if (a.low_m && a.high_m && !(*a.low_m < *a.high_m))
    return complain({Errc::invalid_argument, "--low must be below --high"});
  const auto dem = open_dem(a.dem);
  if (!dem) return complain(dem.error());
  const DemInfo& info = (*dem)->info();
  const auto posts = read_all(**dem);
  if (!posts) return complain_of(a.dem, posts.error());
  const auto range = range_of(a, posts->grid);
  if (!range) return complain_of(a.dem, range.error());
  if (range->low > range->high)
    return complain({Errc::invalid_argument,
                     a.low_m ? fmt::format("--low {:.6g} is above the highest post, {:.6g} m",
                                           range->low, range->high)
                             : fmt::format("--high {:.6g} is below the lowest post, {:.6g} m",
                                           range->high, range->low)});
  ProgressBar bar("relief", progress_style(a.progress));
  const RasterRows light = derivative_rows(**dem, a.shade, bar.progress());
  const auto made =
      encode(*format, info, [&](int row, int count) -> Result<std::vector<std::uint8_t>> {
        const auto strip = light(row, count);
        if (!strip) return std::unexpected(strip.error());
        return colours(posts->grid, row, *strip, *range);
      });
  if (!made) return complain_of(a.dem, made.error());
  const auto turn = OutputTurn::take(a.output);
  if (!turn) return complain(turn.error());
  auto ok = write_whole_file(a.output, *made);
  if (ok && !world.empty()) ok = write_whole_file(world, world_file(info));
  if (!ok) return complain(ok.error());
  const LengthScale scale = length_scale(**dem);
  warn_of_lengths(scale, info, "light and shade are");
  const nlohmann::ordered_json report = {{"cols", info.cols},
                                         {"rows", info.rows},
                                         {"low_m", range->low},
                                         {"high_m", range->high},
                                         {"length_scale", length_scale_json(scale)},
                                         {"input", info.files},
                                         {"output", a.output}};
  return put_report(a.report, report, [&] {
    fmt::print("{}: {} x {} pixels, colours from {:.6g} to {:.6g} m\n", a.output, info.cols,
               info.rows, range->low, range->high);
  });
}

}  // namespace

void add_relief(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app =
      program.add_subcommand("relief", "A DEM's heights as colours, lit from a side, as a picture");
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("-o,--output", a->output, "the picture: .tif, or .png with a .pgw").required();
  app.add_option("--low", a->low_m, "the height of the first colour; without it the lowest post's");
  app.add_option("--high", a->high_m, "the height of the last one; without it the highest post's");
  Shade& light = a->shade.light;
  app.add_option("--azimuth", light.azimuth_deg,
                 "where the light comes from, degrees clockwise from north")
      .range(0., 360.)
      .shown();
  app.add_option("--altitude", light.altitude_deg, "of the light above the horizon, degrees")
      .range(0., 90.)
      .shown();
  app.add_option("--z-factor", light.z_factor, "by which heights are multiplied, for the light")
      .positive()
      .shown();
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_report_options(app, a->report);
  add_progress_option(app, a->progress);
  app.footer("Example: tind relief alps.tif --bounds 7.6,45.9,7.8,46.1 -o relief.png");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
