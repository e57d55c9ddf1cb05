// tind progressive: a DEM or a mesh in, one .tpm out that holds every level of detail.

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "server/api/accuracy_json.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/method_options.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/pictures/mesh_quality.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/bound_text.h"
#include "terrain/base/power_of_two.h"
#include "terrain/mesh/manifold.h"
#include "terrain/progressive/stream/make_progressive.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/progressive/stream/surface_progressive.h"
#include "terrain/raster/height_rounding.h"
#include "terrain/simplify/rounded_posts.h"

namespace tind::cli {

namespace {

constexpr double kPlacesPerPost = 8;  // vertices float: fewer places cost triangles
// Heights are stored in steps of this share of the finest error, ...
constexpr double kStepsInError = 8;
constexpr double kStepsInDiagonal = 65536;  // ... a mesh's coordinates of this share of its size

struct Arguments {
  DemInput input;
  std::string output, progress = "auto";
  MethodLine method;
  SimplifyOptions options;
  std::optional<double> max_error, step, per_post;
  std::size_t base = 64;
  bool method_given = false, json = false;
};

/// A general mesh: no DEM, so no vertical error either.
int run_surface(Arguments& a) {
  if (a.input.files.size() != 1) return complain({Errc::invalid_argument, "one mesh at a time"});
  if (const auto ok = no_dem_options(a.input, a.input.files[0]); !ok) return complain(ok.error());
  if (a.max_error || a.per_post) {
    return complain({Errc::invalid_argument,
                     "--max-error and --lattice need a DEM; a mesh takes --step, the step of its "
                     "coordinates"});
  }
  auto tin = std::holds_alternative<AttributeQemOptions>(a.options.method)
                 ? read_surface(a.input.files[0])
                 : read_shape(a.input.files[0]);
  if (!tin) return complain(tin.error());
  if (has_attributes(*tin))
    warn("a progressive mesh holds the shape alone: colours, normals and texture are left out");
  const Tin* const meshes[] = {&*tin};
  const double diagonal = diagonal_of(*tin);
  if (!(diagonal > 0)) return complain({Errc::bad_data, a.input.files[0] + " has no extent"});
  const auto lattice =
      lattice_of_step(meshes, a.step.value_or(power_of_two_at_most(diagonal / kStepsInDiagonal)));
  if (!lattice) return complain(lattice.error());
  Result<ProgressiveSurface> made;
  {
    ProgressBar bar(a.method.name, progress_style(a.progress));
    made = make_progressive_surface(std::move(*tin), a.options, a.base, *lattice, bar.progress());
  }
  if (!made) return complain(made.error());
  const ProgressiveMesh& pm = made->mesh;
  const auto bytes = write_stream(a.output, to_stream(pm, *lattice));
  if (!bytes) return complain(bytes.error());
  const double base_error = pm.splits.empty() ? pm.fine_error_m : double(pm.splits[0].error_m);
  if (a.json) {
    const nlohmann::ordered_json j = {{"method", a.method.name},
                                      {"base_triangles", pm.base.triangles.size()},
                                      {"base_error", base_error},
                                      {"splits", pm.splits.size()},
                                      {"vertices", pm.base.vertices.size() + pm.splits.size()},
                                      {"fine_error", pm.fine_error_m},
                                      {"step", 1 / lattice->per_unit},
                                      {"split_vertices", made->split_vertices},
                                      {"dropped_triangles", made->dropped_triangles},
                                      {"bytes", *bytes},
                                      {"input", a.input.files},
                                      {"output", a.output}};
    std::printf("%s\n", json::to_text(j, 2).c_str());
    return kOk;
  }
  fmt::print("{}: {} triangles within {} to {} vertices within {}, {} bytes\n", a.method.name,
             pm.base.triangles.size(), bound_text(base_error),
             pm.base.vertices.size() + pm.splits.size(), bound_text(pm.fine_error_m), *bytes);
  if (made->split_vertices + made->dropped_triangles > 0) {
    fmt::print("repaired: {} vertices split, {} triangles dropped (not a manifold)\n",
               made->split_vertices, made->dropped_triangles);
  }
  return kOk;
}

int run(Arguments& a, Command app) {
  const bool surface = is_mesh(a.input.files[0]);
  if (surface && !a.method_given) a.method.name = DefaultMeshMethod::kName;
  const auto method = method_of(app, a.method);
  if (!method) return complain(method.error());
  a.options.method = *method;
  if (const int code = check_outputs({a.output}, inputs_of(a.input)); code != kOk) return code;
  for (const char* option : {"--subset-placement", "--border-constraints"})
    if (surface && app.given(option))
      return complain({Errc::invalid_argument, std::string(option) + " needs a DEM"});
  if (surface) return run_surface(a);
  const auto dem = open_dem(a.input);
  if (!dem) return complain(dem.error());
  const DemInfo& info = (*dem)->info();
  const Result<Terrain> posts = read_all(**dem);
  if (!posts) return complain(posts.error());
  const double error = a.max_error.value_or(std::min(info.spacing_x_m, info.spacing_y_m) / 32);
  if (!(error > 0)) {
    return complain({Errc::invalid_argument,
                     "a progressive mesh needs a maximum error above 0 for its fine end"});
  }
  const Lattice lattice{a.per_post.value_or(kPlacesPerPost),
                        a.step.value_or(error / kStepsInError)};
  const double rounding = height_rounding(info, posts->grid);
  a.options.stop.max_error_m = error;
  if (a.max_error && a.step) {  // heights are up to half a step from where the method puts them
    if (!(*a.step < 2 * error))
      return complain({Errc::invalid_argument,
                       fmt::format("steps of {} m leave no mesh within {} m: give a --step below "
                                   "twice the --max-error, or one of the two alone",
                                   *a.step, error)});
    a.options.stop.max_error_m = error - *a.step / 2;
  }
  a.options.stop = within_rounding(a.options, rounding);
  Result<ProgressiveMesh> made;
  {
    ProgressBar bar(a.method.name, progress_style(a.progress));
    made = make_progressive(*posts, a.options, a.base, bar.progress(), lattice);
  }
  if (!made) return complain_of(a.input, made.error());
  widen(*made, rounding);
  const auto bytes = write_stream(a.output, to_stream(*made, lattice, info, kRungShare));
  if (!bytes) return complain(bytes.error());
  const double base_error =
      made->splits.empty() ? made->fine_error_m : double(made->splits[0].error_m);
  const std::uint64_t isolated = isolated_posts(posts->grid);
  const std::size_t vertices = made->base.vertices.size() + made->splits.size();
  if (a.json) {
    nlohmann::ordered_json j = {
        {"method", a.method.name},      {"base_triangles", made->base.triangles.size()},
        {"base_error_m", base_error},   {"splits", made->splits.size()},
        {"vertices", vertices},         {"fine_error_m", made->fine_error_m},
        {"per_post", lattice.per_post}, {"z_step_m", lattice.z_step_m},
        {"posts_isolated", isolated},   {"bytes", *bytes},
        {"crs", info.crs_name},         {"vertical_datum", name(info.datum)},
        {"input", info.files},          {"output", a.output}};
    if (info.accuracy) j["accuracy"] = api::accuracy_json(*info.accuracy);
    std::printf("%s\n", json::to_text(j, 2).c_str());
  } else {
    fmt::print("{}: {} triangles within {} m to {} vertices within {} m, {} bytes\n", a.method.name,
               made->base.triangles.size(), bound_text(base_error), vertices,
               bound_text(made->fine_error_m), *bytes);
    fmt::print("{}", accuracy_line(info));
    if (isolated > 0)
      fmt::print(
          "{} valid posts have no cell with three valid corners beside them: they are in no "
          "triangle, and no error counts them\n",
          isolated);
  }
  return kOk;
}

}  // namespace

void add_progressive(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "progressive",
      "Make one file of a DEM or a mesh that holds every level of detail, coarse to fine; voids "
      "stay open with every method");
  app.add_option("input", a->input.files,
                 "a DEM, or several that share one grid; or one mesh: .ply, .obj or .stl")
      .required();
  app.add_option("-o,--output", a->output, "the stream: .tpm").required();
  app.add_option("--max-error", a->max_error,
                 "DEM: the error at the fine end, metres; by default 1/32 of the post spacing");
  app.add_option("--base", a->base, "triangles at the coarse end").shown();
  app.add_option("--lattice", a->per_post, "DEM: places a post: 1, 2, 4, ... 1024; by default 8");
  app.add_option(
      "--step", a->step,
      "DEM: step of heights, metres, below twice --max-error; by default an eighth of it. "
      "Mesh: step of its coordinates; by default 1/65536 of its diagonal at most");
  // The bounds of a progressive mesh hold on both sides, and all its collapses are tried.
  add_method_options(app, a->method, a->options.threads, {"side", "effort"});
  add_dem_options(app, a->input);
  add_window_options(app, a->input);
  add_json_flag(app, a->json);
  add_progress_option(app, a->progress);
  app.on_run([a, app, &exit] {
    a->method_given = app.given("--method");
    exit = run(*a, app);
  });
}

}  // namespace tind::cli
