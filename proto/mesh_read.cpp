// Mesh files by their extension, and the texture that an OBJ names by way of its material library.

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "proto/mesh_io.h"
#include "terrain/base/file_io.h"

namespace tind::proto {
namespace {

namespace fs = std::filesystem;

/// A file name that stays in (or below) the folder it is looked up in.
bool stays_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::ranges::none_of(name, [](const fs::path& part) { return part == ".."; });
}

/// A material library that cannot be read costs the texture, not the mesh.
std::string find_texture(const fs::path& obj, const Mesh& mesh) {
  for (const std::string& library : mesh.material_libraries) {
    if (!stays_inside(library)) continue;
    const auto text = read_whole_file((obj.parent_path() / library).string());
    if (!text) continue;
    const std::string texture =
        diffuse_texture(*text, mesh.materials.empty() ? "" : mesh.materials.front());
    if (!texture.empty()) return texture;
  }
  return {};
}

}  // namespace

Result<Mesh> read_mesh(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return char(std::tolower(c)); });
  if (extension != ".ply" && extension != ".obj" && extension != ".stl")
    return fail(Errc::unsupported,
                "cannot read " + path + ": the extension must be .ply, .obj or .stl");
  const auto bytes = read_whole_file(path);
  if (!bytes) return std::unexpected(bytes.error());
  auto mesh = extension == ".ply"   ? decode_ply(*bytes)
              : extension == ".obj" ? decode_obj(*bytes)
                                    : decode_stl(*bytes);
  if (!mesh) return fail(path, mesh.error());
  if (extension == ".obj") mesh->texture = find_texture(path, *mesh);
  return mesh;
}

}  // namespace tind::proto
