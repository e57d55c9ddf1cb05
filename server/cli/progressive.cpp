// tind progressive: a DEM in, one .tpm out that holds every level of detail. tind extract: one
// level of it, as a mesh file.

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/file_io.h"
#include "proto/mesh_io.h"
#include "proto/mesh_stream.h"
#include "server/cli/commands.h"
#include "server/cli/dem_input.h"
#include "server/cli/method_options.h"
#include "server/cli/progress_bar.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/progressive/make_progressive.h"
#include "terrain/progressive/progressive_cursor.h"
#include "terrain/progressive/progressive_stream.h"

namespace tind::cli {

namespace {

constexpr double kStepsInError =
    8;  // heights are stored in steps of this share of the finest error

struct Arguments {
  DemInput input;
  std::string output, progress = "auto";
  SimplifyOptions options;
  std::optional<double> max_error, step;
  std::size_t base = 64;
  double per_post = 2;
  bool json = false;
};

int run(Arguments& a) {
  const auto dem = open_dem(a.input);
  if (!dem) return complain(dem.error());
  const DemInfo& info = (*dem)->info();
  const Result<HeightGrid> grid = read_all(**dem);
  if (!grid) return complain(grid.error());
  const double error = a.max_error.value_or(std::min(info.spacing_x_m, info.spacing_y_m) / 32);
  if (!(error > 0)) {
    return complain({Errc::invalid_argument,
                     "a progressive mesh needs a maximum error above 0 for its fine end"});
  }
  a.options.stop.max_error_m = error;
  const Lattice lattice{a.per_post, a.step.value_or(error / kStepsInError)};
  Result<ProgressiveMesh> made;
  {
    ProgressBar bar(a.options.method, progress_style(a.progress));
    made = make_progressive(*grid, info.spacing_x_m, info.spacing_y_m, a.options, a.base,
                            bar.progress(), lattice);
  }
  if (!made) return complain(made.error());
  const auto stream = to_stream(*made, lattice, info);
  if (!stream) return complain(stream.error());
  const auto bytes = encode(*stream);
  if (!bytes) return complain({Errc::internal, bytes.error()});
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (const auto ok = proto::write_whole_file(a.output, text); !ok) {
    complain({Errc::io, ok.error()});
    return kCannotCreate;
  }
  const double base_error =
      made->splits.empty() ? made->fine_error_m : double(made->splits[0].error_m);
  const std::size_t vertices = made->base.vertices.size() + made->splits.size();
  if (a.json) {
    const nlohmann::ordered_json j = {{"method", a.options.method},
                                      {"base_triangles", made->base.triangles.size()},
                                      {"base_error_m", base_error},
                                      {"splits", made->splits.size()},
                                      {"vertices", vertices},
                                      {"fine_error_m", made->fine_error_m},
                                      {"per_post", lattice.per_post},
                                      {"z_step_m", lattice.z_step_m},
                                      {"bytes", bytes->size()},
                                      {"crs", info.crs_name},
                                      {"vertical_datum", name(info.datum)},
                                      {"input", info.files},
                                      {"output", a.output}};
    std::printf("%s\n", j.dump(2).c_str());
  } else {
    fmt::print("{}: {} triangles within {:.4g} m to {} vertices within {:.4g} m, {} bytes\n",
               a.options.method, made->base.triangles.size(), base_error, vertices,
               made->fine_error_m, bytes->size());
  }
  return kOk;
}

struct Extract {
  std::string input, output;
  std::optional<std::size_t> triangles;
  std::optional<double> max_error;
  bool json = false;
};

Result<std::size_t> state_asked_for(const Extract& a, const ProgressiveMesh& pm,
                                    const ProgressiveCursor& cursor) {
  if (a.triangles) return cursor.position_for_triangles(*a.triangles);
  if (*a.max_error < pm.fine_error_m) {
    return fail(Errc::out_of_range,
                fmt::format("{} reaches an error of {:.4g} m at its finest, not {:.4g} m", a.input,
                            pm.fine_error_m, *a.max_error));
  }
  return cursor.position_for_error(*a.max_error);
}

int run_extract(const Extract& a) {
  const auto file = proto::read_whole_file(a.input);
  if (!file) {
    complain({Errc::io, file.error()});
    return kSourceMissing;
  }
  const auto stream = proto::decode_mesh_stream(
      {reinterpret_cast<const std::uint8_t*>(file->data()), file->size()});
  if (!stream) return complain({Errc::bad_data, a.input + ": " + stream.error()});
  const ProgressiveMesh pm = from_stream(*stream);
  auto cursor = ProgressiveCursor::open(pm);
  if (!cursor) return complain(cursor.error());
  const Result<std::size_t> state = state_asked_for(a, pm, *cursor);
  if (!state) return complain(state.error());
  cursor->seek(*state);
  const DemInfo info = info_of(*stream);
  const MeshMap map = mesh_map(info, MeshFrame::source, false);
  const auto written = proto::write_mesh(a.output, to_file_mesh(map.from_posts(cursor->extract())));
  if (!written) {
    complain({Errc::io, written.error()});
    return kCannotCreate;
  }
  const bool complete = stream->splits.size() == stream->total_splits;
  if (a.json) {
    const nlohmann::ordered_json j = {{"triangles", cursor->triangles()},
                                      {"vertices", cursor->positions().size()},
                                      {"max_error_m", cursor->error_m()},
                                      {"splits", *state},
                                      {"complete", complete},
                                      {"crs", info.crs_name},
                                      {"vertical_datum", name(info.datum)},
                                      {"output", a.output}};
    std::printf("%s\n", j.dump(2).c_str());
  } else {
    fmt::print("{} triangles, {} vertices, every post within {:.4g} m\n", cursor->triangles(),
               cursor->positions().size(), cursor->error_m());
    if (!complete)
      fmt::print("the file is cut off: {} of {} splits are there\n", stream->splits.size(),
                 stream->total_splits);
  }
  return kOk;
}

}  // namespace

void add_progressive(CLI::App& program, int& exit) {
  auto a = std::make_shared<Arguments>();
  a->options.method = "bounded";  // the only one whose order is that of the error
  CLI::App* app = program.add_subcommand(
      "progressive", "Make one file of a DEM that holds every level of detail, coarse to fine");
  app->add_option("input", a->input.files, "a DEM, or several that share one grid")->required();
  app->add_option("-o,--output", a->output, "the stream: .tpm")->required();
  app->add_option("--max-error", a->max_error,
                  "the error at the fine end, metres; by default 1/32 of the post spacing");
  app->add_option("--base", a->base, "triangles at the coarse end")->capture_default_str();
  app->add_option("--lattice", a->per_post, "places a post: 1, 2, 4, ... 1024")
      ->capture_default_str();
  app->add_option("--step", a->step,
                  "step of heights, metres; by default an eighth of the error at the fine end");
  add_method_options(*app, a->options);
  add_dem_options(*app, a->input);
  app->add_flag("--json", a->json, "print the figures as JSON");
  app->add_option("--progress", a->progress, "auto, bar, lines or none")
      ->check(CLI::IsMember({"auto", "bar", "lines", "none"}))
      ->capture_default_str();
  app->callback([a, &exit] { exit = run(*a); });
}

void add_extract(CLI::App& program, int& exit) {
  auto a = std::make_shared<Extract>();
  CLI::App* app =
      program.add_subcommand("extract", "Take one level of detail out of a .tpm, as a mesh file");
  app->add_option("input", a->input, "a .tpm, or the beginning of one")->required();
  app->add_option("-o,--output", a->output, "the mesh: .ply, .obj or .stl")->required();
  CLI::Option_group* group = app->add_option_group("Level (exactly one)");
  group->add_option("--triangles", a->triangles, "the finest level of at most this many triangles");
  group->add_option(
      "--max-error", a->max_error,
      "the coarsest level that is known to be within this error of every post, metres");
  group->require_option(1);
  app->add_flag("--json", a->json, "print the figures as JSON");
  app->callback([a, &exit] { exit = run_extract(*a); });
}

}  // namespace tind::cli
