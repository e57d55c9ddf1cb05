#include "server/cli/options/line_input.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/cli/program/exit.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/simplify/constraints/constraint_heights.h"
#include "terrain/surface/open_surface.h"

namespace tind::cli {

namespace {

/// What is asked of each point of a file.
struct Heights {
  const HeightGrid& grid;
  bool of_dem = false;
  std::size_t all = 0, zeros = 0, far_zeros = 0;  // of those that the file has
  double farthest_m = 0;                          // of zeros from the DEM
  double farthest_up_m = 0;                       // or down

  void take(VectorLine& line) {
    for (Vec3& p : line) {
      if (of_dem) p.z = std::numeric_limits<double>::quiet_NaN();
      if (std::isnan(p.z)) continue;
      ++all;
      if (!(std::abs(p.z) <= std::abs(farthest_up_m))) farthest_up_m = p.z;
      if (p.z != 0) continue;
      ++zeros;
      if (!(p.x >= 0 && p.y <= 0 && p.x <= grid.cols() - 1 && p.y >= 1 - grid.rows())) continue;
      const double ground = height_between_posts(grid, p.x, p.y);
      if (std::isnan(ground)) continue;
      far_zeros += std::abs(ground) > kFar_m;
      farthest_m = std::max(farthest_m, std::abs(ground));
    }
  }

  /// Of no planet's ground, or what some program writes for none.
  Result<void> check(const std::string& path) const {
    constexpr double kMost = 1e6;
    if (std::abs(farthest_up_m) <= kMost) return {};
    return fail(Errc::bad_data,
                fmt::format("{}: has a height of {:g} m, which no ground has; --line-heights dem "
                            "takes the DEM's for all",
                            path, farthest_up_m));
  }

  /// Zeros are what a program writes that has no heights but must write some.
  void warn(const std::string& path) const {
    if (all > 0 && zeros == all && farthest_m >= 1)
      cli::warn(
          fmt::format("{}: every height is 0, up to {:.0f} m from the DEM; if these are no "
                      "heights, --line-heights dem takes the DEM's",
                      path, farthest_m));
    else if (zeros < all && far_zeros > 0)
      cli::warn(
          fmt::format("{}: {} of {} heights are exactly 0, up to {:.0f} m from the DEM; a "
                      "Shapefile holds 0 where no height was given, and --line-heights dem takes "
                      "the DEM's for all",
                      path, zeros, all, farthest_m));
  }

  static constexpr double kFar_m = 20;  // as of polygons of tiles
};

Result<void> check_datum(const std::string& path, const VectorShapes& shapes, const DemInfo& dem) {
  const auto doubts = compare_datums(path, shapes.stated, dem);
  if (!doubts) return std::unexpected(doubts.error());
  for (const std::string& doubt : *doubts) warn(doubt);
  return {};
}

Result<VectorShapes> read_shapes(const std::string& path, const DemSource& dem, Heights heights) {
  auto read = read_vectors(path, dem);
  if (!read) return read;
  if (!heights.of_dem)
    if (auto ok = check_datum(path, *read, dem.info()); !ok) return std::unexpected(ok.error());
  for (VectorLine& line : read->lines) heights.take(line);
  for (VectorPolygon& polygon : read->polygons)
    for (VectorLine& ring : polygon.rings) heights.take(ring);
  if (auto ok = heights.check(path); !ok) return std::unexpected(ok.error());
  heights.warn(path);
  return read;
}

void add_lines(VectorShapes read, ConstraintShapes& shapes) {
  for (VectorLine& line : read.lines) shapes.breaklines.push_back(std::move(line));
  for (VectorPolygon& polygon : read.polygons) {
    for (VectorLine& ring : polygon.rings) {
      if (!ring.empty() && ring.front() != ring.back()) ring.push_back(ring.front());
      shapes.breaklines.push_back(std::move(ring));
    }
  }
}

Result<void> add_polygons(const std::string& path, Result<VectorShapes> read,
                          std::vector<VectorPolygon>& polygons) {
  if (!read) return std::unexpected(read.error());
  if (read->polygons.empty())
    return fail(Errc::bad_data, path + ": has lines only; polygons are needed here");
  if (!read->lines.empty())
    warn(fmt::format("{}: {} lines are left out; polygons are needed here", path,
                     read->lines.size()));
  for (VectorPolygon& polygon : read->polygons) polygons.push_back(std::move(polygon));
  return {};
}

}  // namespace

void add_line_options(Command app, LineInput& lines) {
  app.add_option("--breaklines", lines.breaklines,
                 "keep the lines of this vector file as edges; with its heights, or the DEM's");
  app.add_option("--flatten", lines.flatten,
                 "make the polygons of this vector file level (lakes, runways)");
  app.add_option("--boundary", lines.boundary, "cut the mesh to the polygons of this vector file");
  app.add_option(
         "--line-heights", lines.heights,
         "of breaklines and flattened polygons: their own (line) where they have any, or the "
         "DEM's (dem)")
      .one_of({"line", "dem"})
      .shown();
}

void add_shape_options(Command app, ShapeFiles& files) {
  app.add_option("--breaklines", files.breaklines,
                 "keep the lines of this vector file as edges of tiles, thinned with the level");
  app.add_option("--flatten", files.flatten,
                 "make the polygons of this vector file level, in every level of tiles (lakes, "
                 "runways)");
  app.add_option("--boundary", files.boundary,
                 "posts outside the polygons of this vector file do not count, and tiles wholly "
                 "outside are not made");
  app.add_option(
      "--water", files.water,
      "tiles carry a water mask of the polygons of this vector file, or of this raster's "
      "posts that are valid and not 0; does not flatten: name a file for both");
  app.add_function(
      "--line-heights",
      [&files](const std::string& text) {
        if (auto set = set_shape_option(files, "line_heights", text); !set)
          refuse_value("--line-heights", "takes line or dem");
      },
      "of breaklines and flattened polygons: their own (line, the default) where they have any, "
      "or the DEM's (dem)");
}

Result<Surface> with_shapes(Surface surface, const ShapeFiles& files) {
  auto shaped = shaped_surface(std::move(surface), files);
  if (!shaped) return shaped;
  const SurfaceShapes* shapes = shaped->shapes();
  if (!shapes) return shaped;
  const ShapesReport& r = shapes->report();
  for (const std::string& warning : r.warnings) warn(warning);
  if (r.without_level > 0)
    warn(
        fmt::format("{} polygons to be level have no height of their own and no post in them or "
                    "at their outline: they are at 0 m",
                    r.without_level));
  return shaped;
}

Result<std::shared_ptr<const Constraints>> read_lines(const LineInput& input, const DemSource& dem,
                                                      const Terrain& posts,
                                                      std::vector<VectorLine> more) {
  ConstraintShapes shapes;
  shapes.breaklines = std::move(more);
  const Heights heights{posts.grid, input.heights == "dem"};
  for (const std::string& path : input.breaklines) {
    auto read = read_shapes(path, dem, heights);
    if (!read) return std::unexpected(read.error());
    add_lines(std::move(*read), shapes);
  }
  for (const std::string& path : input.flatten)
    if (const auto ok = add_polygons(path, read_shapes(path, dem, heights), shapes.flatten); !ok)
      return std::unexpected(ok.error());
  for (const std::string& path : input.boundary)
    if (const auto ok = add_polygons(path, read_vectors(path, dem), shapes.boundary); !ok)
      return std::unexpected(ok.error());
  Result<Constraints> made = constrain(posts, shapes);
  if (!made) return std::unexpected(made.error());
  return std::make_shared<const Constraints>(std::move(*made));
}

nlohmann::ordered_json lines_json(const ConstraintReport& r, const ConstraintCheck& c) {
  return {{"breaklines", r.breaklines},         {"flattened", r.flattened},
          {"boundaries", r.boundaries},         {"parts", c.parts},
          {"parts_missing", c.missing},         {"triangles_not_level", c.not_level},
          {"crossings", r.repairs.crossings},   {"overlaps", r.overlaps},
          {"joined_points", r.repairs.joined},  {"bent", r.repairs.bent},
          {"dropped", r.repairs.dropped},       {"not_finite", r.not_finite},
          {"without_length", r.without_length}, {"outside", r.outside},
          {"moved_posts", r.moved_posts},       {"posts_flattened", r.posts_flattened},
          {"posts_outside", r.posts_outside}};
}

std::string lines_text(const ConstraintReport& r, const ConstraintCheck& c) {
  std::string text =
      fmt::format("lines: {} of {} straight parts are edges exactly", c.parts - c.missing, c.parts);
  if (c.parts == 0 && r.boundaries == 0)
    text += "; nothing of them is left: they have no length, or lie outside";
  if (r.flattened > 0)
    text += fmt::format("; {} polygons level ({} triangles are not)", r.flattened, c.not_level);
  if (r.boundaries > 0) text += fmt::format("; {} posts outside the boundary", r.posts_outside);
  text += fmt::format(
      "\nrepaired: {} crossings, {} overlaps, {} points joined, {} segments bent, {} dropped, {} "
      "without length, {} points not finite, {} parts outside; moved by at most {:.2g} post\n",
      r.repairs.crossings, r.overlaps, r.repairs.joined, r.repairs.bent, r.repairs.dropped,
      r.without_length, r.not_finite, r.outside, r.moved_posts);
  return text;
}

}  // namespace tind::cli
