// tind measure: how far is a mesh from a DEM, whoever made it?

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "proto/mesh/mesh_io.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/report_output.h"
#include "server/cli/pictures/mesh_quality.h"
#include "server/cli/pictures/surface_report.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/raster/height_rounding.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string mesh;
  DemInput dem;
  MeshFrame frame = MeshFrame::source;
  std::string units = "metres", progress = "auto";
  bool frame_given = false, units_given = false;
  bool terrain = false;
  int threads = 1;
  ReportOutput report;
};

using Warnings = std::vector<std::string>;

/// Of two things that are measured against each other.
void note_if_elsewhere(const std::string& mesh, const proto::MeshPlace& place, int epsg,
                       const std::string& datum, Warnings& warnings) {
  if (place.epsg > 0 && epsg > 0 && place.epsg != epsg)
    warnings.push_back(
        fmt::format("{} says EPSG:{}, not EPSG:{} as what it is measured against: tind compares "
                    "the numbers as they are",
                    mesh, place.epsg, epsg));
  const auto known = [](const std::string& d) { return !d.empty() && d != "unknown"; };
  if (known(place.vertical_datum) && known(datum) && place.vertical_datum != datum)
    warnings.push_back(
        fmt::format("{} says that its heights are above {}, not {} as what it is measured "
                    "against (for a DEM: --to-datum {})",
                    mesh, place.vertical_datum, datum, place.vertical_datum));
}

/// For a person, and for who reads the report alone.
nlohmann::ordered_json with_warnings(nlohmann::ordered_json report, const Warnings& warnings) {
  for (const std::string& text : warnings) warn(text);
  if (!warnings.empty()) report["warnings"] = warnings;
  return report;
}

bool same_frame(const proto::MeshPlace& a, const proto::MeshPlace& b) {
  return a.local == b.local && a.z_unit_m == b.z_unit_m &&
         (!a.local || (a.origin == b.origin && a.to_crs == b.to_crs));
}

/// Of two meshes.
void note_if_other_frame(const Arguments& a, const PlacedTin& mesh, const proto::MeshPlace& other,
                         Warnings& warnings) {
  note_if_elsewhere(a.mesh, mesh.place, other.epsg, other.vertical_datum, warnings);
  if (is_known(mesh.place) && is_known(other) && !same_frame(mesh.place, other))
    warnings.push_back(
        fmt::format("{} and {} say that their coordinates have other units or origins: tind "
                    "compares the numbers as they are",
                    a.mesh, a.dem.files[0]));
}

/// For the distance of two surfaces; what is measured of terrain is vertical, and needs no such
/// thing.
Result<void> check_surfaces(const Arguments& a, const proto::MeshPlace& mesh,
                            const proto::MeshPlace& other) {
  auto ok = check_surface(a.mesh, mesh);
  if (ok) ok = check_surface(a.dem.files[0], other);
  if (ok) return ok;
  return fail(
      ok.error().code,
      ok.error().what + ", or measure it against a DEM, or with --terrain: the vertical error");
}

/// Two meshes: the distance of their surfaces, both ways.
int run_surfaces(const Arguments& a, const PlacedTin& mesh) {
  if (const auto ok = no_dem_options(a.dem, a.dem.files[0]); !ok) return complain(ok.error());
  const Result<PlacedTin> other = read_placed_tin(a.dem.files[0]);
  if (!other) return complain(other.error());
  if (const auto ok = check_surfaces(a, mesh.place, other->place); !ok) return complain(ok.error());
  for (const PlacedTin* one : {&mesh, &*other})
    if (one->tin.triangles.empty())
      return complain({Errc::bad_data, "a mesh without triangles has no surface to measure"});
  Warnings warnings;
  note_if_other_frame(a, mesh, other->place, warnings);
  const SurfaceDistance d = [&] {
    ProgressBar bar("surface distance", progress_style(a.progress));
    return surface_distance(mesh.tin, other->tin, {.threads = a.threads}, bar.progress());
  }();
  return put_report(a.report, with_warnings(distance_json(d), warnings),
                    [&] { fmt::print("{}", distance_text(d)); });
}

/// A mesh and a TIN: the vertical error over the TIN's vertices.
int run_tin(const Arguments& a, const PlacedTin& mesh) {
  if (a.dem.files.size() != 1 || !is_mesh(a.dem.files[0]))
    return complain({Errc::invalid_argument,
                     "--terrain is for a mesh to measure against: a DEM is terrain anyway"});
  if (const auto ok = no_dem_options(a.dem, a.dem.files[0]); !ok) return complain(ok.error());
  const Result<PlacedTerrain> tin = read_terrain_tin(a.dem.files[0]);
  if (!tin) return complain(tin.error());
  Warnings warnings;
  note_if_other_frame(a, mesh, tin->place, warnings);
  const MeshQuality quality =
      tin_quality(mesh.tin, tin->terrain, a.threads, format_to_read(a.mesh)->as_in_file != nullptr);
  if (quality.error.posts == 0)
    return complain({Errc::bad_data,
                     "the mesh covers no vertex of the TIN: are both in one reference system?"});
  nlohmann::ordered_json j = tin_quality_json(quality);
  j["mesh"] = a.mesh;
  j["tin"] = a.dem.files[0];
  return put_report(a.report, with_warnings(std::move(j), warnings),
                    [&] { fmt::print("{}", tin_quality_text(quality)); });
}

/// As the mesh's file says, unless the user does.
struct Reading {
  Tin mesh;
  MeshMap map;
};
Reading reading(const Arguments& a, PlacedTin mesh, const DemInfo& dem) {
  const bool moved = mesh.place.local && !a.frame_given;
  Reading r{moved ? in_crs(std::move(mesh.tin), mesh.place) : std::move(mesh.tin),
            mesh_map(dem, a.frame, a.units == "source")};
  if (!a.units_given) r.map.z_per_metre = 1 / mesh.place.z_unit_m;
  return r;
}

/// A mesh that reaches farther cannot be told from one of another place or unit, and its planes
/// have no digits left at the posts.
Result<void> near_posts(const std::string& path, const Tin& mesh, const MeshMap& map) {
  constexpr double kFarthest = 1 << 30;  // posts
  for (const Vec3& v : mesh.vertices) {
    const Vec2 at = map.xy.invert(v.x, v.y);
    if (!(std::abs(at.x) < kFarthest && std::abs(at.y) < kFarthest))
      return fail(Errc::bad_data, path +
                                      " reaches more than 1e9 posts beyond the DEM: is it in "
                                      "another CRS, or in another frame (--frame)?");
  }
  return {};
}

int run(const Arguments& a) {
  std::vector<std::string> inputs = inputs_of(a.dem);
  inputs.push_back(a.mesh);
  if (const int code = check_outputs({a.report.path}, inputs); code != kOk) return code;
  Result<PlacedTin> placed = read_placed_tin(a.mesh);
  if (!placed) return complain(placed.error());
  const bool of_two_meshes = a.dem.files.size() == 1 && is_mesh(a.dem.files[0]);
  if (of_two_meshes && (a.frame_given || a.units_given))
    return complain({Errc::invalid_argument,
                     "--frame and --units say how a mesh lies over a DEM; two meshes are measured "
                     "as their files have them"});
  if (a.terrain) return run_tin(a, *placed);
  if (of_two_meshes) return run_surfaces(a, *placed);
  const auto dem = open_dem(a.dem);
  if (!dem) return complain(dem.error());
  const Result<Terrain> posts = read_all(**dem);
  if (!posts) return complain(posts.error());
  const auto here = mesh_place((*dem)->info(), MeshFrame::source, false);
  if (!here) return complain(here.error());
  Warnings warnings;
  note_if_elsewhere(a.mesh, placed->place, here->epsg, here->vertical_datum, warnings);
  const auto [mesh, map] = reading(a, std::move(*placed), (*dem)->info());
  if (auto ok = near_posts(a.mesh, mesh, map); !ok) return complain(ok.error());
  MeshQuality quality = mesh_quality(mesh, map, posts->grid, a.threads,
                                     format_to_read(a.mesh)->as_in_file != nullptr);
  widen(quality, height_rounding((*dem)->info(), posts->grid));
  if (quality.error.posts == 0) {
    return complain({Errc::bad_data,
                     "the mesh covers no valid post of the DEM: are both in one "
                     "frame (--frame), or is the DEM all void?"});
  }
  nlohmann::ordered_json report = quality_json(quality);
  report.update(ground_json(quality, (*dem)->info(), here->epsg));
  report["frame"] = name_of(a.frame);
  report["mesh"] = a.mesh;
  report["dem"] = a.dem.files;
  return put_report(a.report, with_warnings(std::move(report), warnings), [&] {
    fmt::print("{}{}", quality_text(quality), accuracy_line((*dem)->info()));
  });
}

}  // namespace

void add_measure(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand("measure",
                                       "Measure the vertical error of a mesh against every post of "
                                       "a DEM or every vertex of a TIN, or "
                                       "the distance of two meshes' surfaces");
  app.add_option("mesh", a->mesh, "the mesh: " + readable_extensions()).required();
  app.add_option("dem", a->dem.files, "the DEM, or several that share one grid; or a second mesh")
      .required();
  app.add_flag(
      "--terrain", a->terrain,
      "the second mesh is terrain, a TIN: the vertical error over its vertices, instead of "
      "the distance of the two surfaces");
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  app.add_choice("--frame", a->frame,
                 "the mesh's x and y: source (the DEM's CRS) or metric; without it as the mesh's "
                 "file says, else source");
  app.add_option("--units", a->units,
                 "the mesh's z: metres, or source (the DEM's own unit); without it as the mesh's "
                 "file says, else metres")
      .one_of({"metres", "source"});
  app.add_option("--threads", a->threads, "threads to use, 0: one per core").not_negative().shown();
  add_report_options(app, a->report);
  add_progress_option(app, a->progress);
  app.on_run([a, app, &exit] {
    a->frame_given = app.given("--frame");
    a->units_given = app.given("--units");
    exit = run(*a);
  });
}

}  // namespace tind::cli
