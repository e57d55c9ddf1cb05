#pragma once
// THE table of mesh formats: what every command that reads or writes a mesh goes by.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/mesh/mesh_io.h"
#include "terrain/base/result.h"

namespace tind {

struct MeshFormat {
  const char* name = "";
  std::vector<const char*> extensions = {};  // lower case, with their dot; the usual one first
  const char* title = "";
  const char* crs = "";      // how much of the CRS a reader learns
  const char* numbers = "";  // of coordinates: "double", or what becomes of them
  const char* meant_for = "";
  const char* media_type = "application/octet-stream";
  bool colours = false, normals = false, texcoords = false;     // has room for them
  Result<void> (*can_say)(const proto::MeshPlace&) = nullptr;   // null: any place
  Result<std::string> (*encode)(const proto::Mesh&) = nullptr;  // null: tind does not write it
  Result<proto::Mesh> (*decode)(std::string_view) = nullptr;    // null: tind does not read it
  /// Positions as a reader of the file gets them; null: as they are.
  proto::Mesh (*as_in_file)(proto::Mesh) = nullptr;
  /// From where the file counts, in the mesh's coordinates; null: from where these do.
  std::array<double, 3> (*origin)(const proto::Mesh&) = nullptr;
  bool one_unit = false;  // its readers take x, y and z for lengths of one unit
};

std::span<const MeshFormat> mesh_formats();

/// ".ply, .obj ... or .xml": of the formats that can be written, or read.
std::string writable_extensions();
std::string readable_extensions();

/// Which format to write: by its name, or, where that is empty, by the path's extension in any
/// case. Fails (invalid_argument) with the list of what there is.
Result<const MeshFormat*> format_to_write(const std::string& path, const std::string& name = {});

/// Null where the extension is of no format that tind reads.
const MeshFormat* format_to_read(const std::string& path);

/// Null unless the extension is of a format that tind writes and does not read.
const MeshFormat* format_only_written(const std::string& path);

/// Fails (invalid_argument) where the format has no words for such a place: to be asked before long
/// work.
Result<void> can_say(const MeshFormat&, const proto::MeshPlace&);

/// "colours, normals", or "none".
std::string attributes_of(const MeshFormat&);

/// What of the mesh has no room in the format: "colours and normals"; empty where all has.
std::string lost_attributes(const MeshFormat&, const proto::Mesh&);

/// What a reader must add to the file's coordinates to have the mesh's; nothing where that is zero.
std::optional<std::array<double, 3>> file_origin(const MeshFormat&, const proto::Mesh&);

/// Writes by way of a temporary file and a rename (write_whole_file). An OBJ with a texture: also
/// PATH with its extension replaced by .mtl. Fails (invalid_argument) where the format cannot say
/// what the mesh is, (io) where the file cannot be written.
Result<void> write_mesh(const std::string& path, const MeshFormat&, const proto::Mesh&);
/// By the extension.
Result<void> write_mesh(const std::string& path, const proto::Mesh&);

/// Paths of what the mesh at `path` names of other files, there or not: the material libraries of
/// an OBJ with their pictures, the picture of a PLY. Reads the file; empty where that fails.
std::vector<std::string> files_of_mesh(const std::string& path);

/// By the extension; of an OBJ also the texture that its material library names.
Result<proto::Mesh> read_mesh(const std::string& path);

}  // namespace tind
