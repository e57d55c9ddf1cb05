// tind volume: cut and fill of an area, against a height, a plane or another DEM.

#include "terrain/analysis/volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <variant>

#include "server/cli/commands/commands.h"
#include "server/cli/options/level_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/place_input.h"
#include "server/cli/options/plane_scale.h"
#include "server/cli/options/polygon_input.h"
#include "server/cli/options/report_output.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/raster/datums.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  LevelInput level;
  std::optional<double> height_m;
  std::string plane, area, crs = "CRS84", progress = "auto";
  std::vector<std::string> against;
  double uncertainty_m = 0;
  ReportOutput report;
};

/// "X,Y,Z X,Y,Z X,Y,Z". `dem`: whose columns and rows the plane is in.
Result<PlaneReference> plane_of(const Arguments& a, const DemSource& dem) {
  if (dem.info().crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument, dem.info().files.front() +
                                            ": has no CRS, so it is not known where the plane's "
                                            "places lie in it: say its CRS (--crs)");
  const auto n = read_numbers(a.plane, "--plane");
  if (!n) return std::unexpected(n.error());
  if (n->size() != 9)
    return fail(Errc::invalid_argument, "--plane takes three points, \"X,Y,Z X,Y,Z X,Y,Z\"");
  std::string places;
  for (std::size_t i = 0; i < 9; i += 3) places += fmt::format("{},{} ", (*n)[i], (*n)[i + 1]);
  const GeoRect& b = dem.info().bounds;
  const auto where =
      read_places(places, "--plane", a.crs, {(b.west + b.east) / 2, (b.south + b.north) / 2});
  if (!where) return std::unexpected(where.error());
  std::array<Vec2, 3> posts;
  dem.to_post(*where, posts);
  PlaneReference plane;
  for (std::size_t i = 0; i < 3; ++i)
    if (std::abs((*n)[3 * i + 2]) > 1e6)
      return fail(Errc::invalid_argument, "--plane: a height beyond a million metres");
  for (std::size_t i = 0; i < 3; ++i) plane.through[i] = {posts[i].x, posts[i].y, (*n)[3 * i + 2]};
  return plane;
}

struct Reference {
  VolumeReference what;
  double error_m = 0;  // of a TIN's posts
};

Result<Reference> reference_of(const Arguments& a, const DemInput& other, const DemSource& dem) {
  if (a.height_m) return Reference{LevelReference{*a.height_m}};
  if (!a.plane.empty()) {
    const auto plane = plane_of(a, dem);
    if (!plane) return std::unexpected(plane.error());
    return Reference{*plane};
  }
  auto dem2 = open_dem_or_tin(other);
  if (!dem2) return std::unexpected(dem2.error());
  warn_of_datums(dem.info(), dem2->dem->info());
  return Reference{DemReference{std::move(dem2->dem)}, dem2->tin_error_m};
}

/// All polygons of the file together.
Result<PostRings> area_of(const Arguments& a, const DemSource& dem) {
  if (a.area.empty()) return whole_area(dem.info());
  auto areas = read_areas(a.area, dem);
  if (!areas) return std::unexpected(areas.error());
  PostRings all;
  for (NamedArea& one : *areas)
    for (auto& ring : one.rings) all.push_back(std::move(ring));
  return all;
}

/// Over the rectangle around a TIN.
AreaScale area_scale_of(const TinGround& ground) {
  const auto [west, east] = std::ranges::minmax(ground.tin.vertices, {}, &Vec3::x);
  const auto [south, north] = std::ranges::minmax(ground.tin.vertices, {}, &Vec3::y);
  return area_scale(*ground.frame, {west.x, -north.y}, {east.x, -south.y});
}

struct Made {
  Volume volume;
  AreaScale scale;
  double uncertainty_m = 0;
  std::string datum;  // of the heights
};

/// Of a TIN itself: exact.
Result<Made> make_of_tin(const Arguments& a) {
  const auto ground = open_tin_ground(a.dem);
  if (!ground) return std::unexpected(ground.error());
  const DemInfo& info = ground->frame->info();
  std::variant<LevelReference, PlaneReference> reference;
  if (a.height_m) {
    reference = LevelReference{*a.height_m};
  } else {
    const auto plane = plane_of(a, *ground->frame);
    if (!plane) return std::unexpected(plane.error());
    reference = *plane;
  }
  const auto v = volume(*ground, reference, a.uncertainty_m);
  if (!v) return std::unexpected(v.error());
  Made made{*v, area_scale_of(*ground), a.uncertainty_m, name(info.datum)};
  warn_of_areas(made.scale, info);
  return made;
}

Result<Made> make(const Arguments& a) {
  if (asks_tin_itself(a.dem) && a.against.empty() && a.area.empty() && a.level.tiles.empty())
    return make_of_tin(a);
  const TwoDems two = two_dems(a.dem, a.against);
  const auto asked = open_asked(two.first, a.level);
  if (!asked) return std::unexpected(asked.error());
  const auto reference = reference_of(a, two.other, *asked->dem);
  if (!reference) return std::unexpected(reference.error());
  const auto area = area_of(a, *asked->dem);
  if (!area) return std::unexpected(area.error());
  ProgressBar bar("volume", progress_style(a.progress));
  Made made{{}, area_scale(*asked->dem, *area), 0, name(asked->dem->info().datum)};
  // Of tiles the first time tells how far they are off.
  for (int time = 0; time < (asked->level ? 2 : 1); ++time) {
    made.uncertainty_m = a.uncertainty_m + asked->error_m() + reference->error_m;
    auto v = volume(*asked->dem, reference->what, *area, made.uncertainty_m, bar.progress());
    if (!v) return std::unexpected(v.error());
    made.volume = *v;
  }
  if (!a.against.empty() && made.volume.area_m2 == 0)
    return fail(Errc::bad_data, "has a height at no place of the area where the other DEM has one");
  warn_of_areas(made.scale, asked->dem->info());
  return made;
}

nlohmann::ordered_json to_json(const Arguments& a, const Made& made) {
  const Volume& v = made.volume;
  const auto within = [](const Within& w) {
    return nlohmann::ordered_json{{"m3", w.value}, {"low_m3", w.low}, {"high_m3", w.high}};
  };
  nlohmann::ordered_json json = {{"cut", within(v.cut_m3)},
                                 {"fill", within(v.fill_m3)},
                                 {"net", within(v.net_m3)},
                                 {"area_m2", v.area_m2},
                                 {"void_area_m2", v.void_area_m2},
                                 {"area_scale", area_scale_json(made.scale)},
                                 {"beyond_dem", v.beyond},
                                 {"uncertainty_m", made.uncertainty_m},
                                 {"datum", made.datum},
                                 {"input", a.dem.files}};
  if (!a.against.empty()) json["against"] = a.against;
  return json;
}

void print(const Made& made) {
  const Volume& v = made.volume;
  const auto line = [&](const char* name, const Within& w) {
    fmt::print("{:<5}{:>20.3f} m3", name, w.value);
    if (made.uncertainty_m > 0) fmt::print(", from {:.3f} to {:.3f}", w.low, w.high);
    fmt::print("\n");
  };
  line("cut", v.cut_m3);
  line("fill", v.fill_m3);
  line("net", v.net_m3);
  fmt::print("over {:.3f} m2; {:.3f} m2 are void{}\n", v.area_m2, v.void_area_m2,
             v.beyond ? "; some of the area lies beyond the DEM and is not counted" : "");
}

int run(const Arguments& a) {
  std::vector<std::string> inputs = inputs_of(a.dem, a.against);
  if (!a.area.empty()) inputs.push_back(a.area);
  if (const int code = check_outputs({a.report.path}, inputs); code != kOk) return code;
  const auto made = make(a);
  if (!made) return complain_of(a.dem, made.error());
  // What is left of an area whose polygons cancel each other out is a rounding.
  if (made->volume.area_m2 < 1e-3) warn("there is no place with heights to compare in the area");
  return put_report(a.report, to_json(a, *made), [&] { print(*made); });
}

}  // namespace

void add_volume(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "volume", "Cut and fill of an area, against a height, a plane or another DEM");
  app.add_option(
         "input", a->dem.files,
         dem_or_tin_help() + "; against a height or a plane, of all of it, without --posts exactly")
      .required();
  Command against = app.add_group("Against what (exactly one)", 1, 1);
  against
      .add_option("--height", a->height_m,
                  "a height, metres, above what the DEM's (or the tiles') are")
      .range(-1e6, 1e6);
  against.add_option("--plane", a->plane, "the plane through \"X,Y,Z X,Y,Z X,Y,Z\"");
  against.add_option("--against", a->against, "another DEM or TIN, opened as the first is");
  add_places_crs(app, a->crs);
  app.add_option("--area", a->area, "inside the polygons of this vector file; without it: all");
  app.add_option("--uncertainty", a->uncertainty_m,
                 "heights (differences, of two DEMs) are within so many metres of the truth")
      .not_negative()
      .shown();
  add_level_options(app, a->level);
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_report_options(app, a->report);
  add_progress_option(app, a->progress);
  app.footer("Example: tind volume mine.tif --height 412.5 --area pit.geojson --uncertainty 0.1");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
