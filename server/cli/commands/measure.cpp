// tind measure: how far is a mesh from a DEM, whoever made it?

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "proto/mesh_io.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/pictures/mesh_quality.h"
#include "server/cli/pictures/surface_report.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string mesh;
  DemInput dem;
  MeshFrame frame = MeshFrame::source;
  std::string units = "metres";
  int threads = 1;
  bool json = false;
};

/// Two meshes: the distance of their surfaces, both ways.
int run_surfaces(const Arguments& a, const Tin& mesh) {
  const Result<Tin> other = read_tin(a.dem.files[0]);
  if (!other) return complain(other.error());
  for (const Tin* tin : {&mesh, &*other})
    if (tin->triangles.empty())
      return complain({Errc::bad_data, "a mesh without triangles has no surface to measure"});
  const SurfaceDistance d = surface_distance(mesh, *other, {.threads = a.threads});
  if (a.json)
    std::printf("%s\n", json::to_text(distance_json(d), 2).c_str());
  else
    fmt::print("{}", distance_text(d));
  return kOk;
}

int run(const Arguments& a) {
  const Result<Tin> mesh = read_tin(a.mesh);
  if (!mesh) return complain(mesh.error());
  if (a.dem.files.size() == 1 && is_mesh(a.dem.files[0])) return run_surfaces(a, *mesh);
  const auto dem = open_dem(a.dem);
  if (!dem) return complain(dem.error());
  const Result<Terrain> posts = read_all(**dem);
  if (!posts) return complain(posts.error());
  const MeshMap map = mesh_map((*dem)->info(), a.frame, a.units == "source");
  const MeshQuality quality = mesh_quality(*mesh, map, posts->grid, a.threads,
                                           format_to_read(a.mesh)->as_in_file != nullptr);
  if (quality.error.posts == 0) {
    return complain({Errc::bad_data,
                     "the mesh covers no valid post of the DEM: are both in one "
                     "frame (--frame), or is the DEM all void?"});
  }
  if (a.json) {
    nlohmann::ordered_json j = quality_json(quality);
    j.update(ground_json(quality, (*dem)->info()));
    j["frame"] = name_of(a.frame);
    j["mesh"] = a.mesh;
    j["dem"] = a.dem.files;
    std::printf("%s\n", json::to_text(j, 2).c_str());
  } else {
    fmt::print("{}", quality_text(quality));
  }
  return kOk;
}

}  // namespace

void add_measure(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "measure",
      "Measure the vertical error of a mesh against every post of a DEM, or the distance of two "
      "meshes' surfaces");
  app.add_option("mesh", a->mesh, "the mesh: " + readable_extensions()).required();
  app.add_option("dem", a->dem.files, "the DEM, or several that share one grid; or a second mesh")
      .required();
  add_dem_options(app, a->dem);
  app.add_choice("--frame", a->frame, "the mesh's x and y: source (the DEM's CRS) or metric")
      .shown();
  app.add_option("--units", a->units, "the mesh's z: metres, or source (the DEM's own unit)")
      .one_of({"metres", "source"})
      .shown();
  app.add_option("--threads", a->threads, "threads to use, 0: one per core").not_negative().shown();
  add_json_flag(app, a->json);
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
