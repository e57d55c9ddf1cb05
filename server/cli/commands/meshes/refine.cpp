// tind refine: one mesh of a DEM, fine in a region and coarse outside, and how wrong it is there.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "proto/mesh/mesh_io.h"
#include "server/api/accuracy_json.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/report_output.h"
#include "server/cli/pictures/mesh_quality.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/progressive/multires/geo_region.h"
#include "terrain/progressive/multires/levelled_collapse.h"
#include "terrain/progressive/multires/refine_region.h"
#include "terrain/raster/height_rounding.h"

namespace tind::cli {
namespace {

struct Arguments {
  DemInput input;
  MeshOutput output;
  std::string bbox, polygon, route, progress = "auto";
  MeshFrame frame = MeshFrame::source;
  double width_m = 0;
  RegionErrors errors{1, 50};
  int threads = 0;
  ReportOutput report;
};

/// "LON,LAT LON,LAT ..." or "WEST,SOUTH,EAST,NORTH": numbers between commas and blanks.
Result<std::vector<double>> numbers(const std::string& text, const char* option) {
  std::vector<double> out;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    double value = 0;
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value))
      return fail(Errc::invalid_argument,
                  fmt::format("{}: '{}' is no list of decimal degrees", option, text));
    out.push_back(value);
    at = stop;
    while (at < end && (*at == ',' || *at == ' ')) ++at;
  }
  return out;
}

Result<GeoRegion> region_of(const Arguments& a) {
  const bool box = !a.bbox.empty(), ring = !a.polygon.empty();
  const char* const option = box ? "--bbox" : ring ? "--polygon" : "--route";
  const auto n = numbers(box ? a.bbox : ring ? a.polygon : a.route, option);
  if (!n) return std::unexpected(n.error());
  if (box) {
    if (n->size() != 4) return fail(Errc::invalid_argument, "--bbox takes WEST,SOUTH,EAST,NORTH");
    return GeoRegion::box({(*n)[0], (*n)[1], (*n)[2], (*n)[3]});
  }
  if (n->size() % 2)
    return fail(Errc::invalid_argument, fmt::format("{} takes pairs LON,LAT", option));
  GeoRegion out;
  out.closed = ring;
  out.width_m = a.width_m;
  for (std::size_t i = 0; i < n->size(); i += 2) out.points.push_back({(*n)[i], (*n)[i + 1]});
  return out;
}

/// The worst posts on either side of the region's edge, by f(posts of one side).
struct Measured {
  VerticalError inside, outside;
};
template <class F>
Measured by_side(const HeightGrid& grid, const Region& region, F&& f) {
  HeightGrid in = grid, out = grid;
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c)
      (region.contains({double(c), -double(r)}) ? out : in).at(c, r) = HeightGrid::kVoid;
  return {f(in), f(out)};
}

std::string within(const VerticalError& e) {
  std::string text =
      e.posts == 0 ? "no valid post" : fmt::format("{} posts within {:.3f} m", e.posts, e.max_m);
  if (e.uncovered > 0) text += fmt::format(" ({} more beside the mesh)", e.uncovered);
  return text;
}
nlohmann::ordered_json json_of(const VerticalError& e, double asked_m) {
  return {{"asked_m", asked_m},
          {"max_error_m", e.max_m},
          {"posts", e.posts},
          {"posts_uncovered", e.uncovered}};
}

/// What the file's 32-bit coordinates add to an error that the mesh itself keeps.
std::string beyond(const MeshFormat& format, const Measured& measured, const RegionErrors& asked) {
  const double over =
      std::max(measured.inside.max_m - asked.inside_m, measured.outside.max_m - asked.outside_m);
  if (!format.as_in_file || !(over > 1e-8)) return {};
  return fmt::format("the 32-bit coordinates of {} take the mesh {:.3g} m beyond what was asked",
                     format.title, over);
}

int run(const Arguments& a) {
  const auto asked = region_of(a);
  if (!asked) return complain(asked.error());
  if (!(a.errors.inside_m >= 0 && a.errors.inside_m <= a.errors.outside_m))
    return complain({Errc::invalid_argument, "--inside must be 0 or more and not above --outside"});
  const auto format = format_of(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output.path, a.report.path}, inputs_of(a.input));
      code != kOk)
    return code;
  const auto dem = open_dem(a.input);
  if (!dem) return complain(dem.error());
  const DemInfo& info = (*dem)->info();
  const auto place = mesh_place(info, a.frame, false);
  if (!place) return complain(place.error());
  if (const auto ok = can_say(**format, *place); !ok) return complain(ok.error());
  const auto region = asked->over(**dem);
  if (!region) return complain(region.error());
  const Result<Terrain> posts = read_all(**dem);
  if (!posts) return complain(posts.error());
  Result<MultiTriangulation> all;
  {
    ProgressBar bar("refine", progress_style(a.progress));
    all = levelled_terrain(*posts, {.threads = a.threads}, bar.progress());
  }
  if (!all) return complain(all.error());
  const double rounding = height_rounding(info, posts->grid);
  const Tin tin = refine_region(*all, *region, within_rounding(a.errors, rounding)).to_tin();
  const MeshMap map = mesh_map(info, a.frame, false);
  proto::Mesh mesh = to_file_mesh(map.from_posts(tin));
  mesh.place = *place;
  if (const int code = put_mesh(a.output, **format, mesh); code != kOk) return code;
  const Measured measured = by_side(posts->grid, *region, [&](const HeightGrid& side) {
    if (!(*format)->as_in_file) return widened(vertical_error(tin, side, a.threads), rounding);
    MeshQuality written = mesh_quality(as_in_file(**format, mesh), map, side, a.threads, true);
    return widened(written.error, rounding);
  });
  const std::string note = beyond(**format, measured, a.errors);
  nlohmann::ordered_json report = {{"triangles", tin.triangles.size()},
                                   {"vertices", tin.vertices.size()},
                                   {"inside", json_of(measured.inside, a.errors.inside_m)},
                                   {"outside", json_of(measured.outside, a.errors.outside_m)},
                                   {"note", note}};
  report["frame"] = name_of(a.frame);
  report.update(place_json(*place));
  if (info.accuracy) report["accuracy"] = api::accuracy_json(*info.accuracy);
  add_file_origin(report, **format, mesh);
  report["output"] = a.output.path;
  report["format"] = (*format)->name;
  return put_report(a.report, report, [&] {
    fmt::print("{} triangles; inside {}, outside {}\n{}{}", tin.triangles.size(),
               within(measured.inside), within(measured.outside), file_origin_line(report),
               accuracy_line(info));
    if (!note.empty()) fmt::print("note: {}\n", note);
  });
}

}  // namespace

void add_refine(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "refine", "One mesh of a DEM, fine in a region and coarse outside; both errors hold");
  app.add_option("input", a->input.files, "a DEM, or several that share one grid").required();
  add_mesh_output(app, a->output);
  Command group = app.add_group("Region (exactly one), decimal degrees", 1, 1);
  group.add_option("--bbox", a->bbox,
                   "WEST,SOUTH,EAST,NORTH; across the antimeridian 179,-20,181,-10");
  group.add_option("--polygon", a->polygon, "\"LON,LAT LON,LAT LON,LAT ...\"");
  const Option route =
      group.add_option("--route", a->route, "\"LON,LAT LON,LAT ...\", with --width");
  app.add_option("--width", a->width_m, "of the corridor along the route, metres").needs(route);
  app.add_option("--inside", a->errors.inside_m, "error in the region, metres").shown();
  app.add_option("--outside", a->errors.outside_m, "error everywhere else, metres").shown();
  add_dem_options(app, a->input);
  add_window_options(app, a->input);
  add_frame_option(app, a->frame);
  app.add_option("--threads", a->threads, "threads to use, 0: one per core").not_negative().shown();
  add_report_options(app, a->report);
  add_progress_option(app, a->progress);
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
