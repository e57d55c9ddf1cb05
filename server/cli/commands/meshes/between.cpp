// tind between: two meshes of one surface in, one .tpm out whose ends they are.

#include "terrain/progressive/between/between.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/mesh/manifold.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/progressive/stream/space_lattice.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string fine, coarse, output, progress = "auto";
  std::optional<double> step;
  bool json = false;
};

struct Model {
  Tin tin;
  ManifoldRepair repair;
};

Result<Model> read_model(const std::string& path) {
  auto tin = read_shape(path);
  if (!tin) return std::unexpected(tin.error());
  Model out{std::move(*tin), {}};
  out.repair = make_manifold(out.tin);
  drop_unused_vertices(out.tin);
  if (out.tin.triangles.empty()) return fail(Errc::bad_data, path + " has no triangle");
  return out;
}

bool exact(const SpaceLattice& lattice, const Tin& tin) {
  return std::ranges::all_of(tin.vertices, [&](const Vec3& v) { return lattice.snap(v) == v; });
}

int run(const Arguments& a) {
  if (const int code = check_outputs({a.output}, {a.fine, a.coarse}); code != kOk) return code;
  const auto fine = read_model(a.fine), coarse = read_model(a.coarse);
  if (!fine) return complain(fine.error());
  if (!coarse) return complain(coarse.error());
  const Tin* const meshes[] = {&fine->tin, &coarse->tin};
  const Result<SpaceLattice> lattice =
      a.step ? lattice_of_step(meshes, *a.step) : lattice_between(meshes);
  if (!lattice) return complain(lattice.error());
  Result<BetweenModels> made;
  {
    ProgressBar bar("between", progress_style(a.progress));
    made = between_models(fine->tin, coarse->tin, &*lattice, bar.progress());
  }
  if (!made) return complain(made.error());
  const ProgressiveMesh& pm = made->mesh;
  const auto bytes = write_stream(a.output, to_stream(pm, *lattice));
  if (!bytes) return complain(bytes.error());
  const bool all_exact = exact(*lattice, fine->tin) && exact(*lattice, coarse->tin);
  const ManifoldRepair &f = fine->repair, &c = coarse->repair;
  const std::size_t split = f.split_vertices + c.split_vertices,
                    dropped = f.dropped_triangles + c.dropped_triangles;
  if (a.json) {
    const nlohmann::ordered_json j = {{"fine_vertices", fine->tin.vertices.size()},
                                      {"fine_triangles", fine->tin.triangles.size()},
                                      {"coarse_vertices", coarse->tin.vertices.size()},
                                      {"coarse_triangles", coarse->tin.triangles.size()},
                                      {"splits", pm.splits.size()},
                                      {"vertices_split_in", made->split_in},
                                      {"triangles_turned", made->turned},
                                      {"positions_exact", all_exact},
                                      {"step", 1 / lattice->per_unit},
                                      {"split_vertices", split},
                                      {"dropped_triangles", dropped},
                                      {"bytes", *bytes},
                                      {"output", a.output}};
    std::printf("%s\n", json::to_text(j, 2).c_str());
    return kOk;
  }
  fmt::print("{} vertices to {}, in {} splits ({} vertices split in); {} triangles turn over\n",
             coarse->tin.vertices.size(), fine->tin.vertices.size(), pm.splits.size(),
             made->split_in, made->turned);
  if (all_exact)
    fmt::print("both ends exact, {} bytes\n", *bytes);
  else
    fmt::print("positions within {:.3g}, {} bytes\n", lattice->rounding(), *bytes);
  if (split + dropped > 0)
    fmt::print("repaired: {} vertices split, {} triangles dropped (not a manifold)\n", split,
               dropped);
  return kOk;
}

}  // namespace

void add_between(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "between", "Make one file that leads from a coarse mesh to a fine one of the same surface");
  app.add_option("fine", a->fine, "the fine mesh: .ply, .obj or .stl").required();
  app.add_option("coarse", a->coarse, "the coarse one, made by whoever and however").required();
  app.add_option("-o,--output", a->output, "the stream: .tpm").required();
  app.add_option("--step", a->step,
                 "step of the coordinates; by default one that holds both meshes exactly, or else "
                 "the finest that there is");
  app.add_flag("--json", a->json, "print the figures as JSON");
  app.add_option("--progress", a->progress, "auto, bar, lines or none")
      .one_of({"auto", "bar", "lines", "none"})
      .shown();
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
