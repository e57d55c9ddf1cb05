// What an OBJ names by way of its material libraries.

#include <algorithm>
#include <filesystem>

#include "proto/mesh/mesh_io.h"
#include "proto/text_scan.h"
#include "terrain/base/file_io.h"

namespace tind::proto {
namespace {

namespace fs = std::filesystem;

/// A file name that stays in (or below) the folder it is looked up in.
bool stays_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::ranges::none_of(name, [](const fs::path& part) { return part == ".."; });
}

/// A picture's name as the mesh's maker wrote it, perhaps with Windows' separators.
std::string in_folder(const fs::path& folder, std::string name) {
  std::ranges::replace(name, '\\', '/');
  return (folder / name).string();
}

}  // namespace

std::vector<std::string> files_of_obj(const std::string& path, std::string_view obj_text) {
  const fs::path folder = fs::path(path).parent_path();
  std::vector<std::string> files;
  text::Lines lines(obj_text, text::Lines::Join::at_backslash);
  for (std::string_view line; lines.next(line);) {
    if (text::take_word(line) != "mtllib") continue;
    const std::string library(text::trim(line));
    if (!stays_inside(library)) continue;
    files.push_back((folder / library).string());
    const auto text = read_whole_file(files.back());
    if (!text) continue;
    for (std::string& picture : pictures_of_materials(*text))
      files.push_back(in_folder(folder, std::move(picture)));
  }
  return files;
}

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
