#include "server/cli/options/tin_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/cli/options/mesh_input.h"
#include "server/cli/program/exit.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/mesh/tin_posts.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/held_posts.h"

namespace tind::cli {

namespace {

constexpr const char* kSaidOfTins[] = {"--crs",      "--from-datum", "--to-datum",
                                       "--accuracy", "--bounds",     "--bounds-crs"};

Result<void> check_options(const DemInput& input) {
  const std::string& path = input.files[0];
  if (input.files.size() > 1)
    return fail(Errc::invalid_argument, path + ": is a mesh: name it alone, one mesh at a time");
  for (const std::string& flag : input.given)
    if (std::ranges::find(kSaidOfTins, flag) == std::end(kSaidOfTins))
      return fail(Errc::invalid_argument,
                  fmt::format("{} is said of rasters, and {} is a mesh", flag, path));
  return {};
}

std::unexpected<Error> posts_missing(const std::string& path, const std::string& why = "") {
  return fail(Errc::invalid_argument,
              path + ": is a mesh: " + why +
                  "say with --posts how many metres apart its heights are to be taken");
}

/// A TIN where its file says that it is, and what is known of that.
struct Placed {
  Tin tin;
  proto::MeshPlace place;
  std::string crs;
  VerticalDatum datum;
};

Placed placed(PlacedTerrain read, bool crs_said) {
  Placed out{std::move(read.terrain.tin), std::move(read.place), {}, {}};
  const proto::MeshPlace& place = out.place;
  out.crs = place.epsg > 0 ? fmt::format("EPSG:{}", place.epsg) : place.crs_wkt;
  if (const auto datum = datum_named(place.vertical_datum)) out.datum = *datum;
  if (place.local && !out.crs.empty()) out.tin = in_crs(std::move(out.tin), place);
  if (out.crs.empty() && !crs_said)  // lengths are all that x and y can be
    for (Vec3& v : out.tin.vertices) v.x *= place.unit_m, v.y *= place.unit_m;
  return out;
}

/// Metres per unit of x, y and z, by what the CRS is.
Result<Vec3> units(const Placed& p, const std::string& path, const DemOptions& options) {
  const auto [west, east] = std::ranges::minmax(p.tin.vertices, {}, &Vec3::x);
  const auto [south, north] = std::ranges::minmax(p.tin.vertices, {}, &Vec3::y);
  // Its corners as a DEM: the one place that knows what CRSs are.
  const auto corners = dem_of({path,
                               "TIN",
                               HeightGrid(2, 2),
                               {west.x, east.x - west.x, 0, north.y, 0, south.y - north.y},
                               p.crs},
                              {.crs = options.crs});
  if (!corners) return std::unexpected(corners.error());
  const DemInfo& info = (*corners)->info();
  const double z_unit_m = p.place.z_unit_m;
  if (!options.crs.empty() && info.crs_kind == CrsKind::projected)
    if (auto ok = check_unit(path, p.place, info.crs_name, info.crs_unit_m); !ok)
      return std::unexpected(ok.error());
  if (info.crs_kind != CrsKind::geographic) return Vec3{info.crs_unit_m, info.crs_unit_m, z_unit_m};
  const double middle = (info.bounds.south + info.bounds.north) / 2;
  const Vec2 degree = wgs84::metres_per_degree(std::clamp(middle, -89.0, 89.0));
  return Vec3{degree.x, degree.y, z_unit_m};
}

Result<Placed> read_placed(const DemInput& input, const DemOptions& options, Vec3& unit_m) {
  if (auto ok = check_options(input); !ok) return std::unexpected(ok.error());
  const std::string& path = input.files[0];
  auto read = read_terrain_tin(path, options.crs);
  if (!read) return std::unexpected(read.error());
  Placed tin = placed(std::move(*read), !options.crs.empty());
  const auto found = units(tin, path, options);
  if (!found) return std::unexpected(found.error());
  unit_m = *found;
  return tin;
}

}  // namespace

void add_tin_options(Command app, DemInput& input) {
  input.takes_tins = true;
  app.add_option("--posts", input.posts_m,
                 "of a TIN: take its heights on a grid of posts at most so many metres apart; how "
                 "far the surface between posts is from the TIN is measured and said")
      .positive();
}

std::string dem_or_tin_help() {
  return "a DEM, or several that share one grid; or a TIN, with --posts: " + readable_extensions();
}

Result<OpenedDem> open_tin(const DemInput& input) {
  const std::string& path = input.files[0];
  if (!(input.posts_m > 0)) return posts_missing(path);
  const DemOptions options = dem_options(input);
  Vec3 unit_m;
  auto opened = read_placed(input, options, unit_m);
  if (!opened) return std::unexpected(opened.error());
  const Placed& tin = *opened;
  auto posts = tin_posts(tin.tin, unit_m, input.posts_m);
  if (!posts) return fail(path + ": --posts", posts.error());
  HeldPosts held{path, "TIN", std::move(posts->heights), posts->post_to_tin, tin.crs, tin.datum};
  auto dem = dem_of(std::move(held), options);
  if (!dem) return std::unexpected(dem.error());
  const DemInfo& info = (*dem)->info();
  double error_m = posts->error.max_m();
  if (!info.datum_way.empty()) error_m += info.rounding_m;  // of heights that were moved
  note(
      fmt::format("{}: {} x {} posts, {:.6g} x {:.6g} m apart; the surface between them is within "
                  "{:.3g} m of the TIN",
                  path, info.cols, info.rows, posts->post_to_tin.x_col * unit_m.x,
                  -posts->post_to_tin.y_row * unit_m.y, error_m));
  return OpenedDem{std::move(*dem), error_m};
}

bool asks_tin_itself(const DemInput& input) {
  return input.files.size() == 1 && is_mesh(input.files[0]) && input.posts_m == 0;
}

Result<TinGround> open_tin_ground(const DemInput& input) {
  const std::string& path = input.files[0];
  if (input.bounds) return posts_missing(path, "for --bounds ");
  const DemOptions options = dem_options(input);
  Vec3 unit_m;
  auto opened = read_placed(input, options, unit_m);
  if (!opened) return std::unexpected(opened.error());
  auto ground =
      tin_ground(std::move(opened->tin), unit_m, path, opened->crs, opened->datum, options);
  if (ground) warn_of(ground->frame->info());
  return ground;
}

TwoDems two_dems(const DemInput& first, const std::vector<std::string>& other) {
  TwoDems two{first, first};
  DemInput& second = two.other;
  second.files = other;
  second.bounds.reset(), std::erase(second.given, "--bounds"),
      std::erase(second.given, "--bounds-crs");
  const auto is_tin = [](const DemInput& input) {
    return !input.files.empty() && is_mesh(input.files[0]);
  };
  if (is_tin(second) && !is_tin(two.first)) two.first.posts_m = 0;
  if (is_tin(two.first) && !is_tin(second)) second.posts_m = 0;
  return two;
}

}  // namespace tind::cli
