// The texture that an OBJ names by way of its material library.

#include <algorithm>
#include <filesystem>

#include "proto/mesh/mesh_io.h"
#include "terrain/base/file_io.h"

namespace tind::proto {
namespace {

namespace fs = std::filesystem;

/// A file name that stays in (or below) the folder it is looked up in.
bool stays_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::ranges::none_of(name, [](const fs::path& part) { return part == ".."; });
}

}  // namespace

std::string texture_of_obj(const std::string& path, const Mesh& mesh) {
  for (const std::string& library : mesh.material_libraries) {
    if (!stays_inside(library)) continue;
    const auto text = read_whole_file((fs::path(path).parent_path() / library).string());
    if (!text) continue;
    const std::string texture =
        diffuse_texture(*text, mesh.materials.empty() ? "" : mesh.materials.front());
    if (!texture.empty()) return texture;
  }
  return {};
}

}  // namespace tind::proto
