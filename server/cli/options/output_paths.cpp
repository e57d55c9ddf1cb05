#include "server/cli/options/output_paths.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <utility>

#include "server/cli/options/dem_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/program/exit.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/base/lower_case.h"
#include "terrain/base/lower_extension.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/folder/folder_within.h"
#include "terrain/store/open/open_store.h"

namespace tind::cli {
namespace {

namespace fs = std::filesystem;

/// Read beside a file of the same name without its ending: headers and CRSs of rasters, the parts
/// of a Shapefile, the materials of an OBJ.
constexpr std::string_view kBesideStem[] = {".hdr", ".prj", ".tfw", ".tifw", ".pgw", ".wld",
                                            ".blw", ".bpw", ".clr", ".stx",  ".ige", ".rrd",
                                            ".rde", ".aux", ".dbf", ".shx",  ".cpg", ".mtl"};
/// Read beside a file of the same name with its ending.
constexpr std::string_view kBesideName[] = {".aux.xml", ".ovr", ".msk"};

/// One spelling for all names of a file, whether it is there or not.
fs::path real_path(fs::path path) {
  std::error_code error;
  for (int links = 0; links < 40 && fs::is_symlink(path, error) && !fs::exists(path, error);
       ++links)  // a link to what is not there yet
    path = path.parent_path() / fs::read_symlink(path, error);
  fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? fs::absolute(path, error).lexically_normal() : real;
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return a == b || fs::equivalent(a, b, ignored);
}

bool is_device(const fs::path& path) {
  std::error_code ignored;
  const auto status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

bool belongs_to(const fs::path& output, const fs::path& input) {
  if (output.parent_path() != input.parent_path()) return false;
  const std::string name = output.filename().string(), whole = input.filename().string();
  if (name.starts_with(whole))
    return std::ranges::count(kBesideName, lower_case(name.substr(whole.size()))) > 0;
  const std::string ending = lower_extension(output.string());
  const std::string of = lower_extension(input.string());
  if (of == ".tif" && (ending == ".prj" || ending == ".hdr")) return false;  // has its own inside
  if (of == ".tiff" && (ending == ".prj" || ending == ".hdr")) return false;
  if (ending == ".mtl" && of != ".obj") return false;
  return output.stem() == input.stem() && std::ranges::count(kBesideStem, ending) > 0;
}

struct Named {
  std::string name;  // as the user did
  fs::path real;
};

/// With the files that are written beside it.
std::vector<Named> files_of(const std::vector<std::string>& outputs) {
  std::vector<Named> out;
  for (const std::string& path : outputs) {
    if (path.empty() || is_device(path)) continue;
    out.push_back({path, real_path(path)});
    const std::string ending = lower_extension(path);
    const char* const beside = ending == ".asc" ? ".prj" : ending == ".obj" ? ".mtl" : nullptr;
    if (!beside) continue;
    const fs::path second = fs::path(path).replace_extension(beside);
    out.push_back({second.string() + ", written beside " + path + ",", real_path(second)});
  }
  return out;
}

std::vector<Named> read_files(const std::vector<std::string>& inputs) {
  DemOptions options;
  options.allow_vrt = true;  // one more file to keep
  std::vector<Named> out;
  for (const std::string& input : inputs) {
    if (input.starts_with('@')) out.push_back({input.substr(1), real_path(input.substr(1))});
    const auto members = dem_files(std::span(&input, 1), options);
    if (!members) continue;  // whoever opens it says why
    for (const std::string& file : members->files) {
      out.push_back({file, real_path(file)});
      for (const std::string& part : files_of_mesh(file))
        out.push_back({part + ", which " + file + " is read with", real_path(part)});
    }
  }
  return out;
}

/// A .prj that is there without its .asc is another file's, a shapefile's or a header's: that one
/// would be somewhere else from then on. Fails where it cannot be told.
Result<std::string> wrong_beside(const std::vector<std::string>& outputs) {
  for (const std::string& path : outputs) {
    if (lower_extension(path) != ".asc") continue;
    const std::string crs = fs::path(path).replace_extension(".prj").string();
    const auto own = is_there(path), other = is_there(crs);
    for (const auto& there : {own, other})
      if (!there) return std::unexpected(there.error());
    if (!*own && *other)
      return fmt::format(
          "{}, written beside {}, is there already, as another file's: name another output", crs,
          path);
  }
  return std::string();
}

int cannot_create(const Error& why) {
  complain(why);
  return kCannotCreate;
}

/// Before anything is made: a folder alone would be foreign to that tile set already.
int check_lies_in_no_level(const std::string& folder) {
  const auto alone = folder::lies_in_no_level(folder);
  if (alone) return kOk;
  return alone.error().code == Errc::io ? cannot_create(alone.error()) : complain(alone.error());
}

std::string wrong_with(const std::vector<Named>& outputs, const std::vector<Named>& inputs) {
  for (const Named& output : outputs) {
    for (const Named& input : inputs) {
      if (same_file(output.real, input.real))
        return output.name + " is the input " + input.name + ": name another output";
      if (belongs_to(output.real, input.real))
        return output.name + " is read beside the input " + input.name + ": name another output";
    }
  }
  for (std::size_t i = 0; i < outputs.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (same_file(outputs[i].real, outputs[k].real))
        return outputs[k].name + " and " + outputs[i].name +
               " are the same file: each output needs its own";
  return "";
}

/// What VRTs among DEMs are read from. Of those that may not be read nothing is looked at: they can
/// name any file, and addresses.
void add_parts(const DemInput& input, std::vector<std::string>& dems) {
  if (!input.allow_vrt) return;
  DemOptions options;
  options.allow_vrt = true;
  const auto members = dem_files(dems, options);
  if (!members) return;  // whoever opens it says why
  for (const std::string& file : members->files)
    for (std::string& part : files_of_vrt(file)) dems.push_back(std::move(part));
}

}  // namespace

std::vector<std::string> inputs_of(const DemInput& input, const std::vector<std::string>& others) {
  std::vector<std::string> out = input.files;
  out.insert(out.end(), others.begin(), others.end());
  add_parts(input, out);
  out.insert(out.end(), input.datums.begin(), input.datums.end());
  return out;
}

std::vector<std::string> inputs_of(const DemInput& input, const LineInput& lines) {
  std::vector<std::string> out = inputs_of(input);
  for (const auto* files : {&lines.breaklines, &lines.flatten, &lines.boundary})
    out.insert(out.end(), files->begin(), files->end());
  return out;
}

std::vector<std::string> inputs_of(const DemInput& input, const SurfaceInput& layers,
                                   const ShapeFiles& shapes) {
  std::vector<std::string> out = inputs_of(input);
  if (const auto read = read_layers(layers, {}))
    for (const LayerSpec& layer : read->layers)
      out.insert(out.end(), layer.files.begin(), layer.files.end());
  add_parts(input, out);
  for (const auto* files : {&shapes.breaklines, &shapes.flatten, &shapes.boundary, &shapes.water})
    out.insert(out.end(), files->begin(), files->end());
  return out;
}

int check_outputs(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs) {
  if (const std::string wrong = wrong_with(files_of(outputs), read_files(inputs)); !wrong.empty())
    return complain({Errc::invalid_argument, wrong});
  const auto wrong = wrong_beside(outputs);
  if (!wrong) return complain(wrong.error());
  if (!wrong->empty()) return complain({Errc::invalid_argument, *wrong});
  for (const std::string& path : outputs) {
    if (path.empty()) continue;
    if (const auto ok = can_write_file(path); !ok) return cannot_create(ok.error());
  }
  return kOk;
}

int check_output_folder(const std::string& path, const std::vector<std::string>& inputs,
                        const char* known) {
  std::error_code error;
  const fs::path folder = real_path(path);
  if (!fs::exists(folder / known, error))
    for (const std::string& input : inputs)
      if (real_path(input).parent_path() == folder)
        return complain({Errc::invalid_argument,
                         fmt::format("{} holds {}, which is read: name a folder of its own, as {}",
                                     path, input, (fs::path(path) / "tiles").string())});
  if (const int code = check_lies_in_no_level(path); code != kOk) return code;
  fs::create_directories(path, error);
  if (error) return cannot_create({Errc::io, "cannot create " + path + ": " + error.message()});
  const auto ok = can_write_file((fs::path(path) / "tind").string());
  return ok ? int(kOk) : cannot_create({Errc::io, path + ": " + ok.error().what});
}

int check_store_output(const std::string& path) {
  if (remote::is_remote(path)) return kOk;
  if (!names_archive(path))
    if (const int code = check_lies_in_no_level(path); code != kOk) return code;
  std::error_code error;
  const fs::path named = real_path(path);
  fs::path folder = named;
  for (; !fs::is_directory(folder, error) && folder.has_relative_path();
       folder = folder.parent_path())
    if (folder != named && fs::exists(folder, error))
      return cannot_create({Errc::io, "cannot create " + path + ": " + folder.string() +
                                          " is a file, and no folder"});
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return kOk;
  return cannot_create(
      {Errc::io, "cannot create " + path + ": " + folder.string() + ": " + errno_text(errno)});
}

}  // namespace tind::cli
