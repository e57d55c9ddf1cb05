// tind extract: one level of a .tpm, as a mesh file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "proto/mesh/mesh_io.h"
#include "proto/stream/mesh_stream.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "terrain/base/bound_text.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/progressive/stream/progressive_stream.h"

namespace tind::cli {

namespace {

struct Extract {
  std::string input;
  MeshOutput output;
  std::optional<std::size_t> triangles;
  std::optional<double> max_error;
  bool json = false;
};

Result<std::size_t> state_asked_for(const Extract& a, const ProgressiveMesh& pm,
                                    const ProgressiveCursor& cursor) {
  if (a.triangles && *a.triangles < cursor.triangles()) {  // it stands at the coarsest
    return fail(Errc::out_of_range,
                fmt::format("{0} has {1} triangles at its coarsest, not {2}: ask for {1} or more",
                            a.input, cursor.triangles(), *a.triangles));
  }
  if (a.triangles) return cursor.position_for_triangles(*a.triangles);
  if (!a.max_error) return pm.splits.size();
  if (*a.max_error < pm.fine_error_m) {
    return fail(Errc::out_of_range, fmt::format("{} reaches an error of {} at its finest, not {}",
                                                a.input, pm.fine_error_m, *a.max_error));
  }
  return cursor.position_for_error(*a.max_error);
}

/// How far the file's 32-bit coordinates move a vertex, aside and in height, in its numbers;
/// nothing where they are those of the mesh.
struct Rounding {
  double aside = 0, height = 0;
};
std::optional<Rounding> rounding_of(const MeshFormat& format, const proto::Mesh& mesh) {
  if (!format.as_in_file) return {};
  const Tin level = from_file_mesh(mesh), written = as_in_file(format, mesh);
  Rounding most;
  for (std::size_t i = 0; i < level.vertices.size(); ++i) {
    const Vec3 &p = level.vertices[i], &q = written.vertices[i];
    most.aside = std::max(most.aside, std::hypot(p.x - q.x, p.y - q.y));
    most.height = std::max(most.height, std::abs(p.z - q.z));
  }
  return most;
}

int run_extract(const Extract& a) {
  const auto format = format_of(a.output);
  if (!format) return complain(format.error());
  if (const int code = check_outputs({a.output.path}, {a.input}); code != kOk) return code;
  const auto file = read_whole_file(a.input);
  if (!file) return complain(file.error());
  const auto stream = proto::decode_mesh_stream(
      {reinterpret_cast<const std::uint8_t*>(file->data()), file->size()});
  if (!stream) return complain({Errc::bad_data, a.input + ": " + stream.error().what});
  const ProgressiveMesh pm = from_stream(*stream);
  auto cursor = ProgressiveCursor::open(pm);
  if (!cursor) return complain(cursor.error());
  const Result<std::size_t> state = state_asked_for(a, pm, *cursor);
  if (!state) return complain(state.error());
  cursor->seek(*state);
  const bool terrain = stream->frame == proto::StreamFrame::terrain;
  const DemInfo info = terrain ? info_of(*stream) : DemInfo{};
  Tin level = cursor->extract();
  if (terrain) level = mesh_map(info, MeshFrame::source, false).from_posts(std::move(level));
  proto::Mesh mesh = to_file_mesh(std::move(level));
  if (terrain) {
    auto place = mesh_place(info, MeshFrame::source, false);
    if (!place) return complain(place.error());
    mesh.place = std::move(*place);
  }
  if (const int code = put_mesh(a.output, **format, mesh); code != kOk) return code;
  const auto rounding = rounding_of(**format, mesh);
  nlohmann::ordered_json origin = nlohmann::ordered_json::object();
  add_file_origin(origin, **format, mesh);
  const bool complete = stream->splits.size() == stream->total_splits;
  if (a.json) {
    nlohmann::ordered_json j = {{"triangles", cursor->triangles()},
                                {"vertices", cursor->positions().size()},
                                {terrain ? "max_error_m" : "max_error", cursor->error_m()},
                                {"splits", *state},
                                {"complete", complete}};
    if (rounding) j["rounding"] = {{"aside", rounding->aside}, {"height", rounding->height}};
    if (terrain) j.update(place_json(mesh.place));
    j.update(origin);
    j["output"] = a.output.path;
    j["format"] = (*format)->name;
    std::printf("%s\n", json::to_text(j, 2).c_str());
  } else {
    fmt::print("{} triangles, {} vertices, ", cursor->triangles(), cursor->positions().size());
    if (!std::isfinite(cursor->error_m()))
      fmt::print("how far it is off is not known: the file ends before it says so\n");
    else if (terrain)
      fmt::print("every post within {} m\n", bound_text(cursor->error_m()));
    else
      fmt::print("at most {} from the finest surface\n", bound_text(cursor->error_m()));
    fmt::print("{}", file_origin_line(origin));
    if (rounding && (rounding->aside > 0 || rounding->height > 0))
      fmt::print(
          "note: that is of the mesh; the 32-bit coordinates of {} move a vertex by up to {:.3g} "
          "of its units aside and {:.3g} in height\n",
          (*format)->title, rounding->aside, rounding->height);
    if (!complete)
      fmt::print("the file is cut off: {} of {} splits are there\n", stream->splits.size(),
                 stream->total_splits);
  }
  return kOk;
}

}  // namespace

void add_extract(Command program, int& exit) {
  auto a = std::make_shared<Extract>();
  Command app =
      program.add_subcommand("extract", "Take one level of detail out of a .tpm, as a mesh file");
  app.add_option("input", a->input, "a .tpm, or the beginning of one").required();
  add_mesh_output(app, a->output);
  Command group = app.add_group("Level (at most one; without, the finest)", 0, 1);
  group.add_option("--triangles", a->triangles, "the finest level of at most this many triangles");
  group.add_option(
      "--max-error", a->max_error,
      "the coarsest level that is known to be within this error: of every post, metres; of a mesh, "
      "the distance from its finest surface");
  add_json_flag(app, a->json);
  app.on_run([a, &exit] { exit = run_extract(*a); });
}

}  // namespace tind::cli
