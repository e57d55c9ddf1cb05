// tind export: heights as rasters that engines and simulators import.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "proto/tile/layer_json.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/output_turn.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/file_io.h"
#include "terrain/base/lower_extension.h"
#include "terrain/heightmaps/cdb_folder.h"
#include "terrain/heightmaps/heightmap.h"
#include "terrain/surface/on_globe.h"
#include "terrain/surface/stated_accuracy.h"

namespace tind::cli {

namespace {

enum class Target { unreal, unity, cdb };

}  // namespace
}  // namespace tind::cli

namespace tind {
template <>
struct EnumNames<cli::Target> {
  static constexpr const char* kWhat = "format";
  static constexpr std::pair<cli::Target, const char*> kAll[] = {
      {cli::Target::unreal, "unreal"}, {cli::Target::unity, "unity"}, {cli::Target::cdb, "cdb"}};
};
}  // namespace tind

namespace tind::cli {
namespace {

using nlohmann::ordered_json;

struct Arguments {
  DemInput input;
  SurfaceInput layers;
  ShapeFiles shapes;
  Target target = Target::unreal;
  std::string output, size, to_crs, bounds, heights, progress = "auto";
  std::optional<double> spacing;
  MapFit fit = MapFit::cover;
  ByteOrder order = ByteOrder::little;
  FirstRow first = FirstRow::south;
  std::optional<double> deepest;
  int threads = 0;
  bool json = false;
};

/// What one of them takes and the other does not.
constexpr const char* kOfMaps[] = {"--size", "--spacing", "--to-crs", "--fit", "--heights"};
constexpr const char* kOfTiles[] = {"--water", "--breaklines"};
constexpr const char* kOfUnity[] = {"--byte-order", "--first-row"};

std::vector<double> numbers_of(const std::string& text, char separator) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    double value = 0;
    const auto [stop, error] = std::from_chars(text.data() + at, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end || !std::isfinite(value)) return {};
    numbers.push_back(value);
    at = end + 1;
  }
  return numbers;
}

/// "2017", "2017x1009".
Result<void> set_size(const std::string& text, MapOptions& map) {
  const auto n = numbers_of(text, 'x');
  const bool good = (n.size() == 1 || n.size() == 2) && std::ranges::all_of(n, [](double v) {
                      return v == std::floor(v) && v >= 2 && v <= 1e6;
                    });
  if (!good)
    return fail(Errc::invalid_argument, "--size " + text +
                                            ": takes posts a side, 2017 or "
                                            "2017x1009");
  map.cols = int(n.front()), map.rows = int(n.back());
  return {};
}

Result<std::optional<GeoRect>> area_of(const std::string& text) {
  if (text.empty()) return std::optional<GeoRect>();
  auto n = numbers_of(text, ',');
  const bool good = n.size() == 4 && std::abs(n[0]) <= 180 && n[0] != n[2] && n[2] >= -180 &&
                    n[2] <= n[0] + 360 && n[1] >= -90 && n[1] < n[3] && n[3] <= 90;
  if (!good)
    return fail(Errc::invalid_argument,
                "--bounds " + text +
                    ": takes WEST,SOUTH,EAST,NORTH in degrees; across the antimeridian "
                    "179,-20,181,-10 or 179,-20,-179,-10");
  if (n[2] < n[0]) n[2] += 360;
  return std::optional(GeoRect{n[0], n[1], n[2], n[3]});
}

Result<std::optional<HeightRange>> range_of(const std::string& text) {
  if (text.empty()) return std::optional<HeightRange>();
  const auto n = numbers_of(text, ',');
  if (n.size() != 2 || !(n[0] < n[1]))
    return fail(Errc::invalid_argument,
                "--heights " + text + ": takes LOWEST,HIGHEST in metres, the lower first");
  constexpr double kMost = 1e6;
  if (!(std::abs(n[0]) <= kMost && std::abs(n[1]) <= kMost))
    return fail(Errc::invalid_argument, "--heights " + text + ": beyond a million metres");
  return std::optional(HeightRange{n[0], n[1]});
}

Result<void> check_extension(const Arguments& a) {
  const std::string e = lower_extension(a.output);
  if (a.target == Target::unreal && e != ".png" && e != ".r16" && e != ".raw")
    return fail(Errc::invalid_argument,
                a.output + ": Unreal imports .png (16 bits), .r16 or .raw; name it so");
  if (a.target == Target::unity && e != ".raw" && e != ".r16")
    return fail(Errc::invalid_argument, a.output + ": Unity imports .raw or .r16; name it so");
  return {};
}

ordered_json place_json(const Heightmap& map) {
  const MapPlace& p = map.place;
  const Geographic middle = p.place((p.cols - 1) / 2., (p.rows - 1) / 2.);
  const Vec2 corner = p.post(0, 0);
  ordered_json corners;
  for (const auto& [name, col, row] :
       {std::tuple("north_west", 0, 0), std::tuple("north_east", p.cols - 1, 0),
        std::tuple("south_west", 0, p.rows - 1),
        std::tuple("south_east", p.cols - 1, p.rows - 1)}) {
    const Geographic at = p.place(col, row);
    corners[name] = {at.lon, at.lat};
  }
  return {{"crs", p.crs->text()},
          {"north_west_post", {corner.x, corner.y}},
          {"middle", {middle.lon, middle.lat}},
          {"corners", corners},
          {"scale_error", p.scale_error}};
}

/// What to type into the engine. Unreal: centimetres, a height is (value - 32768) / 128 of the
/// landscape's Z scale. Unity: metres, a height is value / 65536 of the terrain's.
ordered_json engine_json(const Heightmap& map, Target target) {
  const MapPlace& p = map.place;
  if (target == Target::unreal) {
    const double scale = p.spacing_m * 100;
    return {{"scale_x", scale},
            {"scale_y", scale},
            {"scale_z", map.step_m * 128 * 100},
            {"location_z_cm", (map.zero_m + 32768 * map.step_m) * 100}};
  }
  return {{"terrain_width", (p.cols - 1) * p.spacing_m},
          {"terrain_length", (p.rows - 1) * p.spacing_m},
          {"terrain_height", map.step_m * 65536},
          {"position_y", map.zero_m}};
}

ordered_json report_of(const Arguments& a, const Heightmap& map, const Surface& surface) {
  const MapPlace& p = map.place;
  const bool unity = a.target == Target::unity, png = lower_extension(a.output) == ".png";
  ordered_json j = {{"format", name_of(a.target)},
                    {"file", std::filesystem::path(a.output).filename().string()},
                    {"cols", p.cols},
                    {"rows", p.rows},
                    {"bits", 16},
                    {"byte_order", name_of(png ? ByteOrder::big : a.order)},
                    {"first_row", name_of(unity ? a.first : FirstRow::north)},
                    {"spacing_m", p.spacing_m},
                    {"world_size_m", {(p.cols - 1) * p.spacing_m, (p.rows - 1) * p.spacing_m}},
                    {"vertical_datum", name(surface.info().datum)}};
  if (const auto stated = stated_accuracy(surface); !stated.empty())
    j["accuracy"] = proto::accuracy_json(stated);
  j.update({{"lowest_m", map.heights.least_m},
            {"highest_m", map.heights.most_m},
            {"height_of_0_m", map.zero_m},
            {"step_m", map.step_m},
            {"max_quantisation_error_m", map.max_error_m},
            {"samples_of_each_post", map.samples},
            {"max_deviation_of_a_sample_m", map.max_deviation_m},
            {"share_without_height", map.without_height}});
  j["place"] = place_json(map);
  j[name_of(a.target)] = engine_json(map, a.target);
  return j;
}

void print(const Arguments& a, const Heightmap& map, const Surface& surface) {
  const MapPlace& p = map.place;
  fmt::print("{} x {} posts, {:.6g} m apart: {:.6g} x {:.6g} m around {:.6f}, {:.6f}\n", p.cols,
             p.rows, p.spacing_m, (p.cols - 1) * p.spacing_m, (p.rows - 1) * p.spacing_m,
             p.place((p.cols - 1) / 2., (p.rows - 1) / 2.).lon,
             p.place((p.cols - 1) / 2., (p.rows - 1) / 2.).lat);
  fmt::print(
      "heights {:.2f} to {:.2f} m in steps of {:.4g} m, none farther than {:.4g} m from its "
      "post's; vertical datum: {}\n",
      map.heights.least_m, map.heights.most_m, map.step_m, map.max_error_m,
      name(surface.info().datum));
  if (map.samples > 1)
    fmt::print(
        "each post is the mean of {} samples, none of which is farther than {:.4g} m from "
        "it\n",
        map.samples, map.max_deviation_m);
  if (map.without_height > 0)
    fmt::print(
        "{:.2f} % of the posts lie where the DEM has no height, and have that of the nearest "
        "one that has{}\n",
        100 * map.without_height,
        a.fit == MapFit::cover ? "; --fit inside leaves out what is around it" : "");
  constexpr double kSmall = 0.01;
  if (p.scale_error > kSmall)
    fmt::print("lengths on the ground differ by up to {:.2g} % from those of the map{}\n",
               100 * p.scale_error,
               a.to_crs.empty() ? ": it is too large for one plane"
                                : ": without --to-crs it gets a projection of its own");
  const ordered_json engine = engine_json(map, a.target);
  fmt::print("{}:", a.target == Target::unreal ? "Unreal" : "Unity");
  for (const auto& [key, value] : engine.items())
    fmt::print(" {} {:.9g}", key, value.get<double>());
  fmt::print("\n");
}

int export_map(const Arguments& a, const Surface& surface) {
  MapOptions options{.engine = a.target == Target::unity ? Engine::unity : Engine::unreal,
                     .spacing_m = a.spacing,
                     .area = {},
                     .crs = a.to_crs,
                     .fit = a.fit};
  if (!a.size.empty())
    if (const auto ok = set_size(a.size, options); !ok) return complain(ok.error());
  const auto area = area_of(a.bounds);
  if (!area) return complain(area.error());
  options.area = *area;
  const auto range = range_of(a.heights);
  if (!range) return complain(range.error());
  const auto place = place_map(surface, options);
  if (!place) return complain(place.error());
  Result<Heightmap> map = fail(Errc::internal, "not run");
  {
    ProgressBar bar("posts", progress_style(a.progress));
    map = make_heightmap(surface, *place, *range, a.threads, stoppable(bar));
  }
  if (!map) return complain(map.error());
  const bool unity = a.target == Target::unity;
  const ordered_json report = report_of(a, *map, surface);
  // A map never stands beside the scale of another one, wherever this ends, and whoever else
  // writes.
  const auto turn = OutputTurn::take(a.output);
  if (!turn) return complain(turn.error());
  std::error_code none;
  std::filesystem::remove(a.output + ".json", none);
  auto written =
      write_whole_file(a.output, lower_extension(a.output) == ".png"
                                     ? png_of(*map)
                                     : raw_of(*map, a.order, unity ? a.first : FirstRow::north));
  if (written) written = write_whole_file(a.output + ".json", json::to_text(report, 1) + "\n");
  if (!written) return complain(written.error());
  if (a.json)
    fmt::print("{}\n", json::to_text(report, 1));
  else
    print(a, *map, surface);
  return kOk;
}

int export_cdb(const Arguments& a, const Surface& surface) {
  const auto area = area_of(a.bounds);
  if (!area) return complain(area.error());
  if (const int code = check_output_folder(a.output); code != kOk) return code;
  if (surface.info().datum != VerticalDatum::ellipsoid)
    warn("CDB counts heights from the ellipsoid, and these are of the datum " +
         name(surface.info().datum));
  cdb::FolderOptions options{
      .output = a.output, .deepest = {}, .area = *area, .threads = a.threads};
  if (a.deepest) options.deepest = int(*a.deepest);
  Result<cdb::FolderReport> report = fail(Errc::internal, "not run");
  {
    ProgressBar bar("tiles", progress_style(a.progress));
    report = cdb::write_folder(surface, options, stoppable(bar));
  }
  if (!report) return complain(report.error());
  const double without =
      report->posts > 0 ? double(report->without_height) / double(report->posts) : 0;
  if (a.json) {
    ordered_json j = {{"format", "cdb"},
                      {"vertical_datum", name(surface.info().datum)},
                      {"deepest_level", report->deepest},
                      {"tiles", report->tiles},
                      {"kept", report->kept},
                      {"bytes", report->bytes},
                      {"max_deviation_of_a_sample_m", report->max_deviation_m},
                      {"share_without_height", without}};
    fmt::print("{}\n", json::to_text(j, 1));
  } else {
    fmt::print("{} tiles of levels -10 to {} ({} kept), {} bytes; vertical datum: {}\n",
               report->tiles, report->deepest, report->kept, report->bytes,
               name(surface.info().datum));
    if (without > 0)
      fmt::print(
          "{:.2f} % of their posts have no height in the DEM: near it they slope from its "
          "edge to 0, which is the standard's default\n",
          100 * without);
  }
  return kOk;
}

Result<void> check(const Arguments& a, Command c) {
  const auto refuse = [&](const char* option, const std::string& whose) {
    return fail(Errc::invalid_argument, std::string(option) + " is for " + whose +
                                            ": leave it out with --format " + name_of(a.target));
  };
  if (a.target == Target::cdb)
    for (const char* option : kOfMaps)
      if (c.given(option)) return refuse(option, "unreal and unity");
  if (a.target != Target::unity)
    for (const char* option : kOfUnity)
      if (c.given(option)) return refuse(option, "unity");
  if (a.target != Target::cdb && c.given("--lod")) return refuse("--lod", "cdb");
  // Posts are means of the heights around them: they have neither masks nor edges.
  for (const char* option : kOfTiles)
    if (c.given(option)) return refuse(option, "tiles");
  return a.target == Target::cdb ? Result<void>() : check_extension(a);
}

int run(Arguments a) {
  if (a.target == Target::cdb) a.input.to_datum = "ellipsoid";  // as the standard has it
  if (a.target != Target::cdb) {
    const auto inputs = inputs_of(a.input, a.layers, a.shapes);
    if (const int code = check_outputs({a.output, a.output + ".json"}, inputs); code != kOk)
      return code;
  }
  auto opened = open_surface(a.input, a.layers);
  if (!opened) return complain(opened.error());
  const auto surface = with_shapes(std::move(*opened), a.shapes);
  if (!surface) return complain(surface.error());
  if (const auto ok = check_on_globe(surface->info()); !ok) return complain(ok.error());
  if (!a.json) fmt::print("{}", layers_text(*surface));
  finish_on_signals();
  const int exit = a.target == Target::cdb ? export_cdb(a, *surface) : export_map(a, *surface);
  if (exit == kOk) warn_of_nodata(*surface);
  return exit;
}

}  // namespace

void add_export(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c =
      program.add_subcommand("export", "Heights as a raster that an engine or a simulator imports");
  c.add_option("DEM", a->input.files, "raster files");
  c.add_option("-o,--output", a->output,
               "the file, beside which its scale is written as FILE.json: .png (16 bits), .r16 "
               "or .raw for unreal, .raw or .r16 for unity; for cdb a directory");
  c.add_choice("--format", a->target,
               "unreal: a landscape's heightmap; unity: a terrain's; cdb: elevations of an OGC CDB "
               "data store")
      .required();
  c.add_option(
      "--size", a->size,
      "posts a side, for unreal also WxH (default: the first size whose posts are as dense "
      "as the DEM's)");
  c.add_option("--spacing", a->spacing, "metres between posts (default: by size and area)")
      .positive();
  c.add_option(
      "--bounds", a->bounds,
      "WEST,SOUTH,EAST,NORTH in degrees; across the antimeridian 179,-20,181,-10 (default: all "
      "of the DEM)");
  c.add_choice("--fit", a->fit,
               "cover: the map holds all of the area, and what lies around it; inside: it lies "
               "inside the area")
      .shown();
  c.add_option("-t,--to-crs", a->to_crs,
               "EPSG:n, the projection, in metres (default: transverse Mercator around the area's "
               "middle)");
  c.add_option("--heights", a->heights,
               "LOWEST,HIGHEST in metres: what 0 and 65535 mean, so that maps side by side agree "
               "(default: of this map)");
  c.add_choice("--byte-order", a->order, "of unity: little (Windows in its dialog), big (Mac)")
      .shown();
  c.add_choice("--first-row", a->first,
               "of unity: south, as it imports them; north, for its box Flip Vertically")
      .shown();
  c.add_option("--lod", a->deepest,
               "of cdb: the deepest level (default: the first that is as fine as the DEM)")
      .range(cdb::kCoarsest, cdb::kFinest);
  add_dem_options(c, a->input);
  add_shape_options(c, a->shapes);
  add_layer_options(c, a->layers);
  c.add_option("--threads", a->threads, "threads (default: one per core)").range(1, 1024);
  add_progress_option(c, a->progress);
  add_json_flag(c, a->json);
  c.footer(
      "A post is the mean of the DEM's heights around it. Heights are above what the DEM's are, "
      "for "
      "cdb above the ellipsoid where that is known.");
  c.on_run([a, c, &exit] {
    if (!names_any(a->input, a->layers)) refuse_missing("DEM");
    if (!c.given("--output")) refuse_missing("--output");
    const auto fits = check(*a, c);
    exit = fits ? run(*a) : complain(fits.error());
  });
}

}  // namespace tind::cli
