#include "server/cli/options/dem_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "server/cli/options/mesh_input.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/exit.h"
#include "terrain/raster/crs_points.h"
#include "terrain/raster/dem_options_text.h"
#include "terrain/raster/dem_window.h"
#include "terrain/raster/nodata.h"

namespace tind::cli {

namespace {

/// A full mesh takes about 200 bytes a post, and its half-edges are numbered with 32 bits.
constexpr std::int64_t kMaxPosts = 400'000'000;

std::string flag_of(std::string name) {
  std::ranges::replace(name, '_', '-');
  return "--" + name;
}

/// "WEST,SOUTH,EAST,NORTH"
std::optional<std::array<double, 4>> box_of(std::string_view text) {
  std::array<double, 4> box{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t k = 0; k < box.size(); ++k) {
    if (k > 0) {
      if (at == end || *at != ',') return {};
      ++at;
    }
    const auto [next, error] = std::from_chars(at, end, box[k]);
    if (error != std::errc() || !std::isfinite(box[k])) return {};
    at = next;
  }
  if (at != end) return {};
  return box;
}

/// The outline of --bounds on the globe.
Result<std::vector<Geographic>> outline_of_bounds(const DemInput& input, const DemInfo& info) {
  auto [west, south, east, north] = *input.bounds;
  if (input.bounds_crs == "CRS84") {
    if (east < west && info.bounds.west > -180 && info.bounds.east < 180)
      return fail(Errc::invalid_argument,
                  "--bounds: west is greater than east, which is the way across the antimeridian; "
                  "the DEM does not lie there");
    if (east < west) east += 360;
    const bool on_earth = west >= -360 && east <= 540 && east - west <= 360 && south >= -90 &&
                          north <= 90 && south < north && west < east;
    if (!on_earth)
      return fail(Errc::invalid_argument,
                  "--bounds takes WEST,SOUTH,EAST,NORTH in degrees, south below north; west may be "
                  "greater than east, across the antimeridian");
    return outline_of({west, south, east, north});
  }
  if (!(west < east && south < north))
    return fail(Errc::invalid_argument,
                "--bounds takes the smaller x and y first, then the greater ones");
  const GeoRect& b = info.bounds;
  const auto crs =
      CrsPoints::make(input.bounds_crs, {(b.west + b.east) / 2, (b.south + b.north) / 2});
  if (!crs) return fail(Errc::invalid_argument, "--bounds-crs: " + crs.error().what);
  std::vector<Vec2> points;
  for (const Geographic& p : outline_of({west, south, east, north}))
    points.push_back((*crs)->east_first() ? Vec2{p.lon, p.lat} : Vec2{p.lat, p.lon});
  std::vector<Geographic> places(points.size());
  (*crs)->to_geographic(points, places);
  return places;
}

/// Does a message begin with the name of a file, or of one in a folder?
bool begins_with(std::string_view what, std::string_view file) {
  if (file.empty() || !what.starts_with(file)) return false;
  const std::string_view rest = what.substr(file.size());
  return file.ends_with('/') || rest.starts_with(":") || rest.starts_with("/") ||
         rest.starts_with(" and ");
}

Result<OpenedDem> open_whole(const DemInput& input) {
  if (input.takes_tins && !input.files.empty() && is_mesh(input.files[0])) return open_tin(input);
  if (input.posts_m > 0)
    return fail(Errc::invalid_argument, "--posts is for a mesh: a DEM has posts of its own");
  auto dem = DemSource::open(input.files, dem_options(input));
  if (!dem) return std::unexpected(not_a_dem(dem.error(), input.files));
  return OpenedDem{std::move(*dem)};
}

}  // namespace

void add_window_options(Command app, DemInput& input) {
  app.add_function(
      "--bounds",
      [&input](const std::string& text) {
        input.bounds = box_of(text);
        if (!input.bounds) refuse_value("--bounds", "takes WEST,SOUTH,EAST,NORTH, four numbers");
        input.given.push_back("--bounds");
      },
      "only the posts of this area: WEST,SOUTH,EAST,NORTH, the rectangle of posts that it lies in");
  app.add_function(
      "--bounds-crs",
      [&input](const std::string& text) {
        if (text != "CRS84" && !is_epsg_code(text))
          refuse_value("--bounds-crs", "takes CRS84 or EPSG:CODE");
        input.bounds_crs = text;
        input.given.push_back("--bounds-crs");
      },
      "what --bounds are in: CRS84 (degrees; the default) or EPSG:CODE, x (east) before y");
}

void add_dem_options(Command app, DemInput& input) {
  input.environment = app.environment();
  for (const DemOptionText& option : dem_option_texts()) {
    const std::string name = option.name, flag = flag_of(name);
    std::string help = option.help;
    if (name == "to_datum")
      help += input.to_datum == "same"
                  ? "; same without it"
                  : "; without it: ellipsoid, where it is known what they are above";
    app.add_function(
        flag,
        [&input, name, flag](const std::string& text) {
          if (const auto ok = say_dem_option(input, name, text); !ok)
            refuse_value(flag, ok.error().what);
        },
        help);
  }
  app.add_flag("--allow-vrt", input.allow_vrt, "read VRT files, which may name any other file");
}

Result<void> say_dem_option(DemInput& input, const std::string& name, const std::string& text) {
  if (auto ok = set_dem_option(name, text, input.said); !ok) return ok;
  input.given.push_back(flag_of(name));
  input.texts.emplace_back(name, text);
  if (name.ends_with("_datum")) input.datums.push_back(text);
  input.to_datum_given = input.to_datum_given || name == "to_datum";
  return {};
}

Result<void> no_dem_options(const DemInput& input, const std::string& mesh) {
  if (input.given.empty()) return {};
  return fail(Errc::invalid_argument,
              fmt::format("{} is said of DEMs, and {} is a mesh", input.given.front(), mesh));
}

DemOptions dem_options(const DemInput& input) {
  DemOptions options = input.said;
  if (!input.to_datum_given && input.to_datum == "ellipsoid")
    options.to_datum = TargetDatum::ellipsoid_if_known;
  options.allow_vrt = input.allow_vrt;
  options.environment = input.environment;
  return options;
}

Result<OpenedDem> open_dem_or_tin(const DemInput& input) {
  auto opened = open_whole(input);
  if (!opened) return opened;
  std::shared_ptr<const DemSource>& dem = opened->dem;
  if (!input.bounds && std::ranges::find(input.given, "--bounds-crs") != input.given.end())
    return fail(Errc::invalid_argument, "--bounds-crs says what --bounds are in: give them, too");
  if (input.bounds) {
    const auto outline = outline_of_bounds(input, dem->info());
    if (!outline) return std::unexpected(outline.error());
    const auto rect = posts_around(*dem, *outline);
    if (!rect) return std::unexpected(rect.error());
    dem = dem_window(std::move(dem), *rect);
  }
  warn_of(dem->info());
  return opened;
}

Result<std::shared_ptr<const DemSource>> open_dem(const DemInput& input) {
  auto opened = open_dem_or_tin(input);
  if (!opened) return std::unexpected(opened.error());
  return std::move(opened->dem);
}

int complain_of(const DemInput& input, const Error& error) {
  const bool named = std::ranges::any_of(
      input.files, [&](const std::string& file) { return begins_with(error.what, file); });
  if (error.code != Errc::bad_data || named) return complain(error);
  return complain({error.code, fmt::format("{}: {}", fmt::join(input.files, ", "), error.what)});
}

Error no_heights() { return {Errc::bad_data, "no post has a height"}; }

void warn_of(const DemInfo& info) {
  for (const std::string& line : info.warnings) warn(line);
}

void warn_of_nodata(const DemSource& dem) {
  if (const std::string line = undeclared_nodata_text(dem); !line.empty()) warn(line);
}

void warn_of_datums(const DemInfo& a, const DemInfo& b) {
  const bool first = a.datum == VerticalDatum::unknown;
  if (first == (b.datum == VerticalDatum::unknown)) return;
  const DemInfo &unknown = first ? a : b, &known = first ? b : a;
  warn(
      fmt::format("heights of {} are above {}, and of {} nobody says above what: they are taken as "
                  "above the same; if they are not, say it with --from-datum",
                  known.files[0], name(known.datum), unknown.files[0]));
}

std::string accuracy_line(const DemInfo& info) {
  if (!info.accuracy) return {};
  return fmt::format("the DEM's own accuracy, as stated: {}\n", text(*info.accuracy));
}

Result<Terrain> read_all(const DemSource& dem) {
  const DemInfo& info = dem.info();
  if (info.cols > kMaxPosts / std::max<std::int64_t>(info.rows, 1)) {
    return fail(Errc::out_of_range,
                fmt::format("{} x {} posts are too many for one mesh (at most {} million); "
                            "use 'tind build', which works tile by tile",
                            info.cols, info.rows, kMaxPosts / 1'000'000));
  }
  auto all = dem.read(0, 0, int(info.cols), int(info.rows));
  if (!all) return std::unexpected(all.error());
  warn_of_nodata(dem);
  return terrain_of(std::move(*all), info);
}

}  // namespace tind::cli
