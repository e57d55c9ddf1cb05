#include "server/cli/line_input.h"

#include <fmt/format.h>

#include <utility>

namespace tind::cli {

namespace {

Result<void> add_lines(const std::string& path, const DemSource& dem, ConstraintShapes& shapes) {
  auto read = read_vectors(path, dem);
  if (!read) return std::unexpected(read.error());
  for (VectorLine& line : read->lines) shapes.breaklines.push_back(std::move(line));
  for (VectorPolygon& polygon : read->polygons) {
    for (VectorLine& ring : polygon.rings) {
      if (!ring.empty() && ring.front() != ring.back()) ring.push_back(ring.front());
      shapes.breaklines.push_back(std::move(ring));
    }
  }
  return {};
}

Result<void> add_polygons(const std::string& path, const DemSource& dem,
                          std::vector<VectorPolygon>& polygons) {
  auto read = read_vectors(path, dem);
  if (!read) return std::unexpected(read.error());
  if (read->polygons.empty())
    return fail(Errc::bad_data, path + ": has lines only; polygons are needed here");
  for (VectorPolygon& polygon : read->polygons) polygons.push_back(std::move(polygon));
  return {};
}

}  // namespace

void add_line_options(CLI::App& app, LineInput& lines) {
  app.add_option("--breaklines", lines.breaklines,
                 "keep the lines of this vector file as edges; with its heights, or the DEM's");
  app.add_option("--flatten", lines.flatten,
                 "make the polygons of this vector file level (lakes, runways)");
  app.add_option("--boundary", lines.boundary, "cut the mesh to the polygons of this vector file");
}

Result<std::shared_ptr<const Constraints>> read_lines(const LineInput& input, const DemSource& dem,
                                                      const HeightGrid& grid) {
  ConstraintShapes shapes;
  for (const std::string& path : input.breaklines)
    if (const auto ok = add_lines(path, dem, shapes); !ok) return std::unexpected(ok.error());
  for (const std::string& path : input.flatten)
    if (const auto ok = add_polygons(path, dem, shapes.flatten); !ok)
      return std::unexpected(ok.error());
  for (const std::string& path : input.boundary)
    if (const auto ok = add_polygons(path, dem, shapes.boundary); !ok)
      return std::unexpected(ok.error());
  Result<Constraints> made = constrain(grid, shapes);
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
