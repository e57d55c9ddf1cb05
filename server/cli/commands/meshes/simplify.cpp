// tind simplify: a DEM in, one mesh and its report out.

#include "terrain/simplify/simplify.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "proto/mesh/mesh_io.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/drape_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/method_options.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/raster_output.h"
#include "server/cli/pictures/mesh_quality.h"
#include "server/cli/pictures/surface_report.h"
#include "server/cli/program/dem_strips.h"
#include "server/cli/program/peak_memory.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/manifold.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/raster/height_rounding.h"
#include "terrain/simplify/bounded/bounded.h"
#include "terrain/simplify/collapse/attribute_quadric.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/constraints/voids.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/rounded_posts.h"
#include "terrain/simplify/simplify_mesh.h"
#include "terrain/simplify/simplify_tin.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput input;
  LineInput lines;
  MeshOutput output;
  RasterOutput rasters;
  const MeshFormat* format = nullptr;
  std::string report, drape;
  MethodLine method;
  SimplifyOptions options;
  MeshFrame frame = MeshFrame::source;
  std::string units = "metres", progress = "auto";
  bool json = false;
  bool terrain = false;  // a mesh is to be one
  Voids voids = Voids::cover;
  bool voids_given = false;

  const std::string& voids_alone() const { return info_of(options.method).voids_alone; }
  bool opens() const { return voids == Voids::keep && voids_alone() != "holes"; }
  bool fills() const { return voids == Voids::cover && voids_alone() != "covered"; }
};

struct Seconds {
  double read = 0, simplify = 0, measure = 0, write = 0;
};

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double s = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return s;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// A mesh for which terrain alone has an answer: a bound, or a method that knows nothing else.
bool wants_terrain(const Arguments& a) {
  return a.options.stop.max_error_m || !takes_meshes(a.options.method);
}

/// What can be refused before a large file is read.
Result<void> check(Arguments& a, Command app) {
  const auto format = format_of(a.output);
  if (!format) return std::unexpected(format.error());
  a.format = *format;
  if (const auto ok = check(a.rasters); !ok) return ok;
  if (!a.drape.empty() && !a.format->colours)
    return fail(Errc::invalid_argument, fmt::format("{} has no room for the colours of --drape: "
                                                    "write .ply, .obj, .glb or .vtu",
                                                    a.format->title));
  const auto method = method_of(app, a.method);
  if (!method) return std::unexpected(method.error());
  a.options.method = *method;
  a.voids_given = app.given("--voids");
  if (!is_mesh(a.input.files[0])) {
    if (a.terrain)
      return fail(Errc::invalid_argument, "--terrain is for a mesh: a DEM is terrain anyway");
    return {};
  }
  a.terrain |= wants_terrain(a);
  for (const char* option : {"--from-datum", "--to-datum", "--allow-vrt", "--drape", "--frame",
                             "--units", "--raster", "--error-raster", "--voids"})
    if (app.given(option))
      return fail(Errc::invalid_argument, std::string(option) + " needs a DEM, not a mesh");
  for (const char* option : {"--subset-placement", "--border-constraints"})
    if (app.given(option) && !a.terrain)
      return fail(Errc::invalid_argument, std::string(option) +
                                              " needs a DEM, or a mesh that is terrain "
                                              "(--terrain)");
  return {};
}

nlohmann::ordered_json seconds_json(const Seconds& s) {
  return {{"read", s.read}, {"simplify", s.simplify}, {"measure", s.measure}, {"write", s.write}};
}

nlohmann::ordered_json details_json(const Simplified& made) {
  nlohmann::ordered_json j = nlohmann::ordered_json::object();
  for (const auto& [key, value] : made.details) j[key] = value;
  return j;
}

/// `cluster` and `bounded` can do without the whole source in memory, and do where that is much.
/// `cluster` then leaves wide voids open; who asks for either way in so many words gets it.
bool streams(const Arguments& a, const DemInfo& info) {
  const bool able =
      (std::holds_alternative<ClusterOptions>(a.options.method) && !a.voids_given) ||
      (std::holds_alternative<BoundedOptions>(a.options.method) && goes_by_rows(a.options));
  return able && !a.lines.any() && !a.opens() && info.cols * info.rows > kStreamPosts &&
         info.cols <= INT_MAX && info.rows <= INT_MAX;
}

bool leaves_wide_voids_open(const Arguments& a, const DemInfo& info, const MeshQuality& quality) {
  const auto valid = std::int64_t(quality.error.posts + quality.uncovered);
  return a.fills() && streams(a, info) && valid < info.cols * info.rows;
}

nlohmann::ordered_json report_json(const Arguments& a, const DemInfo& info,
                                   const proto::MeshPlace& place, const Simplified& made,
                                   const MeshQuality& quality, const Seconds& seconds) {
  nlohmann::ordered_json j = {
      {"method", a.method.name}, {"steps", made.steps}, {"input_triangles", made.input_triangles}};
  j.update(quality_json(quality));
  j.update(ground_json(quality, info, place.epsg));
  j["voids"] = leaves_wide_voids_open(a, info, quality) ? "narrow" : name_of(a.voids);
  j["frame"] = name_of(a.frame);
  j["units"] = a.units;
  j.update(place_json(place));
  j["spacing_m"] = {info.spacing_x_m, info.spacing_y_m};
  j["seconds"] = seconds_json(seconds);
  j["peak_mb"] = PeakMemory::megabytes();
  j["details"] = details_json(made);
  j["note"] = made.note;
  j["input"] = info.files;
  j["output"] = a.output.path;
  j["format"] = a.format->name;
  if (!a.rasters.heights.empty()) j["raster"] = a.rasters.heights;
  if (!a.rasters.errors.empty()) j["error_raster"] = a.rasters.errors;
  return j;
}

void print_end(const Seconds& s, const Simplified& made) {
  fmt::print("seconds: read {:.3f}, simplify {:.3f}, write {:.3f}, measure {:.3f}\n", s.read,
             s.simplify, s.write, s.measure);
  if (!made.note.empty()) fmt::print("note: {}\n", made.note);
}

void print(const Arguments& a, const DemInfo& info, const nlohmann::ordered_json& report,
           const Simplified& made, const MeshQuality& quality, const Seconds& s) {
  if (a.json) {
    std::printf("%s\n", json::to_text(report, 2).c_str());
    return;
  }
  fmt::print("{}: {} of {} triangles in {} steps\n{}", a.method.name, quality.triangles,
             made.input_triangles, made.steps, quality_text(quality));
  fmt::print("{}{}", file_origin_line(report), accuracy_line(info));
  print_end(s, made);
}

bool breaks_bound(const Arguments& a, const MeshQuality& quality) {
  return a.options.stop.max_error_m &&
         quality.error.max_m > *a.options.stop.max_error_m * (1 + 1e-9) + 1e-8;
}

void add_note(Simplified& made, const std::string& note) {
  made.note += (made.note.empty() ? "" : "; ") + note;
}

/// A TIN with a step along a seam, or with a vertex in the middle of another triangle's edge, is
/// not within 0 of its own vertices. What goes beyond that, too, is still the method's.
void tell_of_steps(const Arguments& a, const TerrainTin& of, const MeshQuality& quality,
                   Simplified& made) {
  const double own = tin_quality(of.tin, of, a.options.threads).error.max_m;
  if (quality.error.max_m > *a.options.stop.max_error_m + own + 1e-8) return;
  made.note = fmt::format(
      "vertices of {} lie up to {:.3g} m from its own triangles (a step along a seam, or one in "
      "the middle of another's edge): there the bound cannot hold",
      a.input.files[0], own);
}

/// The referee has the last word on a bound: what breaks it has a reason that is told, or is a bug.
Result<void> hold_to_bound(const Arguments& a, const MeshQuality& quality, Simplified& made) {
  if (!breaks_bound(a, quality) || !made.note.empty()) return {};
  const double bound = *a.options.stop.max_error_m;
  if (!a.format->as_in_file) {
    return fail(Errc::internal,
                fmt::format("{} keeps {} m, not {} m: this is a bug, the mesh in "
                            "{} does not hold what was asked",
                            a.method.name, quality.error.max_m, bound, a.output.path));
  }
  made.note = fmt::format("the 32-bit coordinates of {} take the mesh {:.3g} m beyond the bound",
                          a.format->title, quality.error.max_m - bound);
  return {};
}

/// No method leaves out a post that a triangle of posts holds; 32 bits of a degree may.
void tell_of_posts_lost(const Arguments& a, const MeshQuality& quality, Simplified& made) {
  if (!a.format->as_in_file || a.lines.any() || quality.uncovered <= quality.isolated) return;
  add_note(made,
           fmt::format("the 32-bit coordinates of {} leave {} posts beside the mesh: {}PLY and OBJ "
                       "hold them",
                       a.format->title, quality.uncovered - quality.isolated,
                       a.frame == MeshFrame::metric ? "" : "--frame metric, or "));
}

/// No method flips a triangle; 32 bits of a coordinate may.
void tell_of_flips(const Arguments& a, const MeshQuality& quality, Simplified& made) {
  if (!a.format->as_in_file || quality.flipped == 0) return;
  add_note(made, fmt::format("the 32-bit coordinates of {} flip {} narrow triangles: {}PLY and OBJ "
                             "hold them",
                             a.format->title, quality.flipped,
                             a.frame == MeshFrame::metric ? "" : "--frame metric, or "));
}

/// Where one was asked for.
int put_report(const Arguments& a, const nlohmann::ordered_json& report) {
  if (a.report.empty()) return kOk;
  const auto ok = write_whole_file(a.report, json::to_text(report, 2) + "\n");
  return ok ? int(kOk) : complain(ok.error());
}

/// What every mesh as input asks for first.
Result<void> check_mesh_input(const Arguments& a) {
  if (a.input.files.size() != 1) return fail(Errc::invalid_argument, "one mesh at a time");
  if (a.lines.any())
    return fail(Errc::invalid_argument, "--breaklines, --flatten and --boundary need a DEM");
  return no_dem_options(a.input, a.input.files[0]);
}

/// What a mesh file calls a texture, for one that may lie in another folder.
std::string texture_beside(const std::string& texture, const std::string& from,
                           const std::string& to) {
  namespace fs = std::filesystem;
  if (texture.empty() || fs::path(texture).is_absolute() || texture.contains("://")) return texture;
  std::error_code error;
  const auto folder = [&](const std::string& file) {
    return fs::weakly_canonical(fs::absolute(file, error).parent_path(), error);
  };
  // What goes to a pipe is seen from where one works.
  const bool piped = to.starts_with("/dev/");
  const fs::path in = folder(from), out = piped ? fs::current_path(error) : folder(to);
  return error || in == out ? texture : (in / texture).lexically_relative(out).generic_string();
}

/// Attributes that a method has dropped: it carries those that it goes by.
std::string not_carried(const Tin& from, const Tin& to) {
  std::vector<std::string> lost;
  if (!from.colours.empty() && to.colours.empty()) lost.push_back("colours");
  if (!from.normals.empty() && to.normals.empty()) lost.push_back("normals");
  if (!from.texcoords.empty() && to.texcoords.empty()) lost.push_back("texture coordinates");
  return fmt::format("{}", fmt::join(lost, " and "));
}

/// A general mesh in, a general mesh out; its error is the distance of the two surfaces.
int run_mesh(const Arguments& a) {
  if (const auto ok = check_mesh_input(a); !ok) return complain(ok.error());
  auto read = read_placed_tin(a.input.files[0]);
  if (!read) return complain(read.error());
  if (const auto ok = check_surface(a.input.files[0], read->place); !ok)
    return complain({ok.error().code,
                     ok.error().what + ", or simplify it as terrain (--terrain or --max-error), by "
                                       "its vertical error"});
  Tin& tin = read->tin;
  if (const auto ok = can_say(*a.format, read->place); !ok) return complain(ok.error());
  if (const std::string lost = lost_attributes(*a.format, to_file_mesh(tin)); !lost.empty())
    warn(fmt::format("{} has no room for the {} of {}", a.format->title, lost, a.input.files[0]));
  if (!read->texture.empty() && read->materials > 1)
    warn(fmt::format("{} has {} materials: the mesh gets the first one's texture for all",
                     a.input.files[0], read->materials));
  const auto* const attributed = std::get_if<AttributeQemOptions>(&a.options.method);
  if (attributed && asks_for_normals(*attributed) && tin.normals.empty())
    tin.normals = vertex_normals(tin);
  Stopwatch watch;
  Result<SimplifiedMesh> result;
  {
    ProgressBar bar(a.method.name, progress_style(a.progress));
    result = simplify_mesh(tin, a.options, bar.progress());
  }
  if (!result) return complain(result.error());
  const double seconds = watch.lap();
  const Simplified& made = result->made;
  if (const std::string lost = not_carried(tin, made.tin); !lost.empty())
    warn(fmt::format("{} carries no {} of this mesh: they are left out", a.method.name, lost));
  const SurfaceDistance d = [&] {
    ProgressBar bar("surface distance", progress_style(a.progress));
    return surface_distance(tin, made.tin, {.threads = a.options.threads}, bar.progress());
  }();
  proto::Mesh mesh = to_file_mesh(made.tin);
  mesh.place = read->place;
  if (!mesh.texcoords.empty())
    mesh.texture = texture_beside(read->texture, a.input.files[0], a.output.path);
  const int wrote_mesh = put_mesh(a.output, *a.format, mesh);
  if (wrote_mesh != kOk) return wrote_mesh;
  nlohmann::ordered_json report = {{"method", a.method.name},
                                   {"steps", made.steps},
                                   {"input_triangles", made.input_triangles},
                                   {"triangles", made.tin.triangles.size()},
                                   {"split_vertices", result->split_vertices},
                                   {"dropped_triangles", result->dropped_triangles},
                                   {"seam_vertices", result->seam_vertices},
                                   {"seconds", seconds},
                                   {"peak_mb", PeakMemory::megabytes()}};
  report.update(distance_json(d));
  if (is_known(read->place)) report.update(place_json(read->place));
  add_file_origin(report, *a.format, mesh);
  report["note"] = made.note;
  if (const int code = put_report(a, report); code != kOk) return code;
  if (a.json) {
    std::printf("%s\n", json::to_text(report, 2).c_str());
    return kOk;
  }
  fmt::print("{}: {} of {} triangles in {} steps, {:.3f} s\n{}", a.method.name,
             made.tin.triangles.size(), made.input_triangles, made.steps, seconds,
             distance_text(d));
  if (result->split_vertices + result->dropped_triangles > 0) {
    fmt::print("repaired: {} vertices split, {} triangles dropped (not a manifold)\n",
               result->split_vertices, result->dropped_triangles);
  }
  if (result->seam_vertices > 0)
    fmt::print("seams: {} vertices share their place with another and stay\n",
               result->seam_vertices);
  fmt::print("{}", file_origin_line(report));
  if (!made.note.empty()) fmt::print("note: {}\n", made.note);
  return kOk;
}

/// Terrain that is a mesh already; its error is over its vertices.
int run_tin(const Arguments& a) {
  if (const auto ok = check_mesh_input(a); !ok) return complain(ok.error());
  Seconds seconds;
  Stopwatch watch;
  const auto read = read_terrain_tin(a.input.files[0]);
  if (!read) {
    const bool surface = read.error().code == Errc::bad_data;
    return complain({read.error().code,
                     read.error().what +
                         (surface ? "; a surface in space takes --triangles or --ratio with qem, "
                                    "attribute-qem or triangle-collapse, without --terrain"
                                  : "")});
  }
  if (const auto ok = can_say(*a.format, read->place); !ok) return complain(ok.error());
  if (read->had_attributes)
    warn(fmt::format("terrain keeps its shape alone: the attributes of {} are left out",
                     a.input.files[0]));
  seconds.read = watch.lap();
  Result<Simplified> made;
  {
    ProgressBar bar(a.method.name, progress_style(a.progress));
    made = simplify_tin(read->terrain, a.options, bar.progress());
  }
  if (!made) return complain(made.error());
  seconds.simplify = watch.lap();
  proto::Mesh mesh = to_file_mesh(std::move(made->tin));
  mesh.place = read->place;
  if (const int code = put_mesh(a.output, *a.format, mesh); code != kOk) return code;
  nlohmann::ordered_json origin = nlohmann::ordered_json::object();
  add_file_origin(origin, *a.format, mesh);
  const Tin written = as_in_file(*a.format, std::move(mesh));
  seconds.write = watch.lap();
  const MeshQuality quality =
      tin_quality(written, read->terrain, a.options.threads, a.format->as_in_file != nullptr);
  seconds.measure = watch.lap();
  if (breaks_bound(a, quality) && made->note.empty())
    tell_of_steps(a, read->terrain, quality, *made);
  if (const auto ok = hold_to_bound(a, quality, *made); !ok) return complain(ok.error());
  tell_of_flips(a, quality, *made);
  nlohmann::ordered_json report = {{"method", a.method.name},
                                   {"steps", made->steps},
                                   {"input_triangles", made->input_triangles}};
  report.update(tin_quality_json(quality));
  if (is_known(read->place)) report.update(place_json(read->place));
  report["seconds"] = seconds_json(seconds);
  report["peak_mb"] = PeakMemory::megabytes();
  report["details"] = details_json(*made);
  report["note"] = made->note;
  report["input"] = a.input.files;
  report["output"] = a.output.path;
  report["format"] = a.format->name;
  report.update(origin);
  if (const int code = put_report(a, report); code != kOk) return code;
  if (a.json) {
    std::printf("%s\n", json::to_text(report, 2).c_str());
    return kOk;
  }
  fmt::print("{}: {} of {} triangles in {} steps\n{}{}", a.method.name, quality.triangles,
             made->input_triangles, made->steps, tin_quality_text(quality),
             file_origin_line(report));
  print_end(seconds, *made);
  return kOk;
}

Result<Simplified> make_in_strips(const SimplifyOptions& o, const DemSource& dem,
                                  const Progress& progress) {
  const DemInfo& info = dem.info();
  const int cols = int(info.cols), rows = int(info.rows);
  if (std::holds_alternative<ClusterOptions>(o.method))
    return cluster_stream(cols, rows, info.spacing_x_m, info.spacing_y_m, o.stop, rows_of(dem),
                          progress);
  return simplify_bounded_rows({cols, rows, strips_of(dem)}, info.spacing_x_m, info.spacing_y_m,
                               std::get<BoundedOptions>(o.method), o, progress);
}

/// Of a DEM in memory.
RasterRows rows_in(const HeightGrid& grid) {
  return [&grid](int row, int rows) -> Result<HeightGrid> {
    HeightGrid strip(grid.cols(), rows);
    for (int r = 0; r < rows; ++r) std::ranges::copy(grid.row(row + r), strip.row(r).begin());
    return strip;
  };
}

int run(Arguments& a, Command app) {
  const bool mesh_input = is_mesh(a.input.files[0]);
  if (!app.given("--method") && mesh_input && !a.terrain && !a.options.stop.max_error_m)
    a.method.name = DefaultMeshMethod::kName;
  if (const Result<void> ok = check(a, app); !ok) return complain(ok.error());
  std::vector<std::string> inputs = inputs_of(a.input, a.lines);
  inputs.push_back(a.drape);
  if (const int code =
          check_outputs({a.output.path, a.report, a.rasters.heights, a.rasters.errors}, inputs);
      code != kOk)
    return code;
  if (mesh_input) return a.terrain ? run_tin(a) : run_mesh(a);
  Seconds seconds;
  Stopwatch watch;
  const auto dem = open_dem(a.input);
  if (!dem) return complain(dem.error());
  const DemInfo& info = (*dem)->info();
  const auto place = mesh_place(info, a.frame, a.units == "source");
  if (!place) return complain(place.error());
  if (const auto ok = can_say(*a.format, *place); !ok) return complain(ok.error());
  if (const auto ok = check(a.rasters, info); !ok) return complain(ok.error());
  const bool stream = streams(a, info);
  Result<Terrain> posts = stream ? Terrain() : read_all(**dem);
  if (!posts) return complain(posts.error());
  HeightGrid before;  // what there is of a DEM whose voids are filled for the method
  if ((a.fills() || a.opens()) && has_voids(posts->grid)) {
    before = posts->grid;
    posts->grid = covered(std::move(posts->grid));
  }
  const bool opened = a.opens() && before.size() > 0;
  if (a.lines.any() || opened) {
    auto constraints =
        read_lines(a.lines, **dem, *posts, opened ? void_rims(before) : std::vector<VectorLine>());
    if (!constraints) return complain(constraints.error());
    a.options.constraints = std::move(*constraints);
    *posts = a.options.constraints->dem;
  }
  if (!a.drape.empty()) {
    auto drape = drape_posts(a.drape, **dem);
    if (!drape) return complain(drape.error());
    std::get<AttributeQemOptions>(a.options.method).drape = std::move(*drape);
  }
  const double rounding = stream ? info.rounding_m : height_rounding(info, posts->grid);
  SimplifyOptions options = a.options;
  options.stop = within_rounding(options, rounding);
  seconds.read = watch.lap();

  Result<Simplified> made;
  {
    ProgressBar bar(a.method.name, progress_style(a.progress));
    const Progress progress = bar.progress();
    made = stream ? make_in_strips(options, **dem, progress) : simplify(*posts, options, progress);
  }
  if (!made) return complain_of(a.input, made.error());
  if (stream) warn_of_nodata(**dem);
  for (std::size_t i = 0; i < before.size(); ++i)
    if (std::isnan(before.values()[i])) posts->grid.values()[i] = HeightGrid::kVoid;
  if (opened) open_voids(made->tin, before);
  if (opened && made->tin.triangles.empty()) return complain_of(a.input, no_triangle(before));
  seconds.simplify = watch.lap();
  std::optional<ConstraintCheck> lines;
  if (a.lines.any()) lines = check_constraints(made->tin, *a.options.constraints);
  const auto attributes = attribute_errors(a.options, *posts, made->tin);
  keep_side(a.options, rounding, made->tin);
  watch.lap();

  if (a.rasters.any()) {
    const RasterRows rows = stream ? strips_of(**dem) : rows_in(posts->grid);
    const int code = write_rasters(a.rasters, info, made->tin, rows, a.options.threads);
    if (code != kOk) return code;
  }
  const MeshMap map = mesh_map(info, a.frame, a.units == "source");
  proto::Mesh mesh = to_file_mesh(map.from_posts(std::move(made->tin)));
  mesh.place = *place;
  if (const int code = put_mesh(a.output, *a.format, mesh); code != kOk) return code;
  nlohmann::ordered_json origin = nlohmann::ordered_json::object();
  add_file_origin(origin, *a.format, mesh);
  const Tin written = as_in_file(*a.format, std::move(mesh));
  const bool rounded = a.format->as_in_file != nullptr;
  seconds.write = watch.lap();
  Result<MeshQuality> quality =
      stream ? mesh_quality_in_strips(written, map, int(info.cols), int(info.rows),
                                      strips_of(**dem), a.options.threads, rounded)
             : mesh_quality(written, map, posts->grid, a.options.threads, rounded);
  if (!quality) return complain(quality.error());
  widen(*quality, rounding);
  seconds.measure = watch.lap();
  if (breaks_bound(a, *quality) && !has_room_for_rounding(a.options, rounding))
    add_note(*made,
             fmt::format("heights are rounded by up to {:.3g} m as they are read, which takes the "
                         "mesh beyond the bound",
                         rounding));
  if (const auto ok = hold_to_bound(a, *quality, *made); !ok) return complain(ok.error());

  tell_of_posts_lost(a, *quality, *made);
  tell_of_flips(a, *quality, *made);
  if (leaves_wide_voids_open(a, info, *quality))
    add_note(*made,
             "voids wider than a cell stay open, since the DEM is read strip by strip: --voids "
             "cover holds it in memory");

  nlohmann::ordered_json report = report_json(a, info, *place, *made, *quality, seconds);
  report.update(origin);
  if (lines) report["lines"] = lines_json(a.options.constraints->report, *lines);
  if (attributes) report["surface"] = distance_json(*attributes);
  if (const int code = put_report(a, report); code != kOk) return code;
  print(a, info, report, *made, *quality, seconds);
  if (lines && !a.json) fmt::print("{}", lines_text(a.options.constraints->report, *lines));
  if (attributes && !a.json) fmt::print("{}", distance_text(*attributes));
  return kOk;
}

void add_stop(Command app, StopAt& stop) {
  Command group = app.add_group("Stop at (exactly one)", 1, 1);
  group.add_option("--triangles", stop.triangles, "at most this many triangles, and hardly fewer");
  group.add_option("--ratio", stop.ratio, "at most this share of the full mesh's triangles, 0..1");
  group.add_option("--max-error", stop.max_error_m,
                   "the fewest triangles within this vertical error of every post (of a mesh: of "
                   "every vertex), metres; strict");
}

}  // namespace

void add_simplify(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "simplify", "Simplify a DEM (or a mesh) to one triangle mesh whose error is measured");
  app.add_option("input", a->input.files,
                 "a DEM, or several that share one grid; or one mesh: " + readable_extensions())
      .required();
  app.add_flag("--terrain", a->terrain,
               "a mesh is terrain, heights over a plane: its error is the vertical one over its "
               "vertices, and its border stays; without it only where --max-error or a method asks "
               "for terrain, otherwise it is a surface in space");
  add_mesh_output(app, a->output);
  add_stop(app, a->options.stop);
  add_method_options(app, a->method, a->options.threads);
  add_dem_options(app, a->input);
  add_window_options(app, a->input);
  add_line_options(app, a->lines);
  app.add_choice(
         "--voids", a->voids,
         "what the mesh has where the DEM has no data: cover closes voids, and no valid post is "
         "left out; keep leaves them open")
      .shown();
  app.add_option("--drape", a->drape,
                 "attribute-qem: colours from this image, reprojected or stretched over the DEM");
  add_frame_option(app, a->frame);
  app.add_option("--units", a->units, "z in metres, or in the DEM's own unit")
      .one_of({"metres", "source"})
      .shown();
  add_raster_output(app, a->rasters);
  app.add_option("--report", a->report, "write the figures here, as JSON");
  add_json_flag(app, a->json);
  add_progress_option(app, a->progress);
  app.on_run([a, app, &exit] { exit = run(*a, app); });
}

}  // namespace tind::cli
