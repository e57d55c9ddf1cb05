#pragma once
// The options that many subcommands share about what they print and write.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/cli/program/command_line.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/mesh/tin.h"

namespace tind::cli {

/// Where a mesh goes, and as what.
struct MeshOutput {
  std::string path, format;  // format: empty, the path's extension says it
};

/// -o, --output and --format.
void add_mesh_output(Command, MeshOutput&);

/// Fails (invalid_argument) with the list of formats: before any work.
Result<const MeshFormat*> format_of(const MeshOutput&);

/// Writes it. kOk, or says why not. Warns where readers of the format would take degrees for
/// lengths.
int put_mesh(const MeshOutput&, const MeshFormat&, const proto::Mesh&);

/// The mesh as it stands in the file: some formats have 32-bit coordinates only.
Tin as_in_file(const MeshFormat&, proto::Mesh);

/// Where its numbers are, for a report: crs, epsg (null without a code), crs_wkt, vertical_datum;
/// in the metric frame origin and metres_to_crs.
nlohmann::ordered_json place_json(const proto::MeshPlace&);
/// file_origin, where the file counts from elsewhere.
void add_file_origin(nlohmann::ordered_json& report, const MeshFormat&, const proto::Mesh&);
/// The same for people; empty where it is not in the report.
std::string file_origin_line(const nlohmann::ordered_json& report);
/// Does it say anything?
bool is_known(const proto::MeshPlace&);

/// --frame: where x and y of a written mesh are counted from.
void add_frame_option(Command, MeshFrame& frame);

/// --progress auto|bar|lines|none (progress_bar.h).
void add_progress_option(Command, std::string& progress);

/// --json, for the figures.
void add_json_flag(Command, bool& json);

}  // namespace tind::cli
