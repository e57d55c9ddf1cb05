// tind explain: what one tile is made of, how wrong it is and where, and why it is as fine as
// it is.

#include "terrain/check/explain.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/pictures/explain_picture.h"
#include "server/cli/program/progress_bar.h"
#include "server/log/printable.h"
#include "terrain/base/file_io.h"
#include "terrain/simplify/options.h"
#include "terrain/store/open/open_store.h"
#include "terrain/surface/stated_accuracy.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string where, tile, png;
  DemInput dem;
  SurfaceInput layers;
  ShapeFiles shapes;
  double error_factor = 1;
  std::string progress = "auto";
  bool json = false;
};

/// "z/x/y", also with ".terrain" behind it.
std::optional<TileId> parse_tile(std::string text) {
  if (text.ends_with(".terrain")) text.resize(text.size() - 8);
  std::int64_t n[3] = {};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int k = 0; k < 3; ++k) {
    if (k > 0) {
      if (at == end || *at != '/') return std::nullopt;
      ++at;
    }
    const auto [after, error] = std::from_chars(at, end, n[k]);
    if (error != std::errc()) return std::nullopt;
    at = after;
  }
  return at == end ? tiling::tile(n[0], n[1], n[2]) : std::nullopt;
}

nlohmann::ordered_json to_json(const PostStatistics& p) {
  nlohmann::ordered_json j;
  for (const PostStatistics::File& f : p.files)
    j["files"].push_back({{"name", f.name}, {"posts", f.posts}});
  j["posts"] = p.posts;
  j["voids"] = p.voids;
  j["filled_share"] = p.filled_share;
  if (p.posts == 0) return j;
  j["max_error_m"] = p.max_error_m;
  j["mesh_above_m"] = p.above_m;
  j["mesh_below_m"] = p.below_m;
  j["mean_error_m"] = p.mean_m;
  j["rms_error_m"] = p.rms_m;
  j["posts_near_budget"] = p.near_budget;
  j["worst"] = {{"lon", p.worst.place.lon},     {"lat", p.worst.place.lat},
                {"col", p.worst.col},           {"row", p.worst.row},
                {"height_m", p.worst.height_m}, {"mesh_minus_post_m", p.worst.error_m}};
  j["histogram"] = {{"from_m", -p.max_error_m}, {"to_m", p.max_error_m}, {"posts", p.histogram}};
  return j;
}

nlohmann::ordered_json to_json(const LineStory& l) {
  return {{"lines", l.lines},       {"too_small", l.too_small},     {"points", l.points},
          {"vertices", l.vertices}, {"tolerance_m", l.tolerance_m}, {"farthest_m", l.farthest_m}};
}

nlohmann::ordered_json to_json(const TileExplanation& s, const std::optional<Surface>& source) {
  nlohmann::ordered_json j;
  j["tile"] = s.id.text();
  j["rectangle"] = {s.rect.west, s.rect.south, s.rect.east, s.rect.north};
  j["bytes"] = s.bytes;
  j["triangles"] = s.mesh.triangles.size();
  j["vertices"] = {{"all", s.mesh.u.size()},
                   {"edges", s.border_vertices},
                   {"lattice", s.lattice_vertices},
                   {"free", s.free_vertices}};
  for (const auto& [level, count] : s.origins)
    j["vertices_by_level"].push_back({{"level", level}, {"vertices", count}});
  j["stated_max_error_m"] =
      s.stated.max_error_m ? nlohmann::ordered_json(*s.stated.max_error_m) : nullptr;
  j["stated_as"] = s.stated.exact ? "exact" : "bound";
  if (s.stated.residual_m) j["residual_m"] = *s.stated.residual_m;
  j["side"] = name_of(s.stated.side);
  if (!s.method.empty()) j["method"] = s.method;
  j["budget_m"] = s.budget_m;
  if (s.lines) j["lines"] = to_json(*s.lines);
  j["limited_by"] = s.limited_by;
  j["because"] = s.because;
  if (s.posts) j["source"] = to_json(*s.posts);
  if (source)
    if (const auto stated = stated_accuracy(*source); !stated.empty())
      j["accuracy"] = proto::accuracy_json(stated);
  return j;
}

void print_histogram(const PostStatistics& p) {
  constexpr std::uint64_t kWidth = 46;
  const std::uint64_t most = std::max<std::uint64_t>(1, *std::ranges::max_element(p.histogram));
  fmt::print("\n  mesh minus post, m      posts\n");
  for (int b = 0; b < PostStatistics::kBins; ++b) {
    const double step = 2 * p.max_error_m / PostStatistics::kBins;
    const std::uint64_t n = p.histogram[std::size_t(b)];
    fmt::print("  {:>8.3g} .. {:<8.3g} {:>8}  {}\n", -p.max_error_m + b * step,
               -p.max_error_m + (b + 1) * step, n,
               std::string(std::size_t((n * kWidth + most - 1) / most), '#'));
  }
}

void print(const PostStatistics& p, double budget_m) {
  fmt::print("posts       {} valid, {} void; {:.1f} % of the rectangle is filled\n", p.posts,
             p.voids, 100 * p.filled_share);
  for (const PostStatistics::File& f : p.files)
    fmt::print("            {} from {}\n", f.posts, f.name);
  if (p.posts == 0) return;
  fmt::print(
      "errors      {:.6g} m at most (mesh above {:.6g}, below {:.6g}), mean {:.4g}, RMS {:.4g}\n",
      p.max_error_m, p.above_m, p.below_m, p.mean_m, p.rms_m);
  fmt::print("            {} posts beyond nine tenths of the budget of {:.6g} m\n", p.near_budget,
             budget_m);
  fmt::print("worst       {:.7f}, {:.7f} (post {}, {}): height {:.3f} m, mesh {:+.6g} m\n",
             p.worst.place.lon, p.worst.place.lat, p.worst.col, p.worst.row, p.worst.height_m,
             p.worst.error_m);
  print_histogram(p);
}

void print(const LineStory& l) {
  fmt::print("lines       {} in the tile, {} too small for its level\n", l.lines + l.too_small,
             l.too_small);
  if (l.lines == 0) return;
  fmt::print(
      "            of their {} points {} are vertices; the lines are at most {:.4g} m beside them "
      "(the level allows {:.4g} m)\n",
      l.points, l.vertices, l.farthest_m, l.tolerance_m);
}

void print_accuracy(const Surface& source) {
  for (const SurfaceLayer& layer : source.layers())
    if (const auto& accuracy = layer.source->info().accuracy)
      fmt::print("accuracy    {}{}, as stated\n", source.only() ? "" : layer.name + ": ",
                 text(*accuracy));
}

void print(const TileExplanation& s, const std::optional<Surface>& source) {
  fmt::print("tile        {}: {:.9g}..{:.9g} E, {:.9g}..{:.9g} N\n", s.id.text(), s.rect.west,
             s.rect.east, s.rect.south, s.rect.north);
  fmt::print(
      "mesh        {} bytes, {} triangles, {} vertices: {} on edges, {} of the lattice, {} free\n",
      s.bytes, s.mesh.triangles.size(), s.mesh.u.size(), s.border_vertices, s.lattice_vertices,
      s.free_vertices);
  fmt::print("            by the level that they come from:");
  for (const auto& [level, count] : s.origins) fmt::print(" {} from {};", count, level);
  fmt::print("\n");
  if (s.stated.max_error_m)
    fmt::print("states      {:.6g} m ({}), side {}\n", *s.stated.max_error_m,
               s.stated.exact ? "exact"
               : s.stated.residual_m
                   ? fmt::format("a bound, by the residual index; its share is {:.6g} m at most",
                                 *s.stated.residual_m)
                   : "a bound, with the rounding of projected places or converted heights",
               name_of(s.stated.side));
  else
    fmt::print("states      no error\n");
  if (!s.method.empty())
    fmt::print("made by     {}{}\n", logging::printable(s.method),
               s.method == BoundedOptions::kName
                   ? ""
                   : ", or by bounded where that could not keep the budget");
  if (source) print_accuracy(*source);
  if (s.lines) print(*s.lines);
  fmt::print("so fine by  {}: {}\n", s.limited_by, s.because);
  if (s.posts) print(*s.posts, s.budget_m);
}

Result<void> write_picture(const Arguments& a, const TileExplanation& story,
                           const std::optional<Surface>& source) {
  const auto picture = explain_picture(story, source ? &*source : nullptr);
  if (!picture) return std::unexpected(picture.error());
  return write_whole_file(a.png, encode_png(*picture));
}

int run(const Arguments& a) {
  const auto id = parse_tile(a.tile);
  if (!id)
    return complain(
        {Errc::invalid_argument, "'" + a.tile +
                                     "' is no tile of the pyramid: z/x/y, rows from the "
                                     "south, two columns at level 0"});
  if (const int code = check_outputs({a.png}, inputs_of(a.dem)); code != kOk) return code;
  std::optional<Surface> source;
  if (names_any(a.dem, a.layers)) {
    auto opened = open_surface(a.dem, a.layers);
    if (opened) opened = with_shapes(std::move(*opened), a.shapes);
    if (!opened) return complain(opened.error());
    source.emplace(*opened);
  } else if (a.shapes.any()) {
    return complain({Errc::invalid_argument,
                     "lines and water are explained with the DEM that they lie on: --source DEM"});
  }
  ExplainOptions options{
      .files = a.dem.files, .dem = dem_options(a.dem), .error_factor = a.error_factor};
  if (source && (!source->only() || a.shapes.any())) options.surface = source;
  Result<TileExplanation> story = fail(Errc::internal, "not looked at");
  {
    ProgressBar bar("posts", progress_style(a.progress));
    story = explain_tile(*open_store(a.where), *id, options, bar.progress());
  }
  if (!story) return complain(story.error());
  if (!a.png.empty())
    if (const auto done = write_picture(a, *story, source); !done) return complain(done.error());
  if (a.json)
    fmt::print("{}\n", json::to_text(to_json(*story, source), 2));
  else
    print(*story, source);
  return kOk;
}

}  // namespace

void add_explain(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "explain", "What a tile is made of, where it is most wrong, and why it is as fine as it is");
  app.add_option("DIR|URL", a->where,
                 "where the tiles are: a directory, X.pmtiles, X.mbtiles or a server (its key in "
                 "TIND_KEY)")
      .required();
  app.add_option("TILE", a->tile, "z/x/y, rows from the south").required();
  app.add_option("--source", a->dem.files, "the DEM that the tiles were made of");
  a->dem.to_datum = "ellipsoid";  // as tind build has it
  add_dem_options(app, a->dem);
  add_layer_options(app, a->layers);
  add_shape_options(app, a->shapes);
  app.add_option("--png", a->png,
                 "write a picture: relief, the mesh's edges, and with --source its error in colour "
                 "(blue: mesh below, red: above) and the worst post");
  app.add_option("--error-factor", a->error_factor,
                 "what the tiles were built with, where tind build left no record")
      .positive()
      .shown();
  add_progress_option(app, a->progress);
  app.add_flag("--json", a->json, "print everything as JSON");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
