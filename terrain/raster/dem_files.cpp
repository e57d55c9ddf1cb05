#include "terrain/raster/dem_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <unordered_set>

#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/base/lower_case.h"
#include "terrain/raster/remote/objects.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kRasterEndings[] = {
    ".tif", ".tiff", ".tif.zip", ".tiff.zip", ".hgt", ".hgt.zip", ".dt0", ".dt1",
    ".dt2", ".dem",  ".asc",     ".img",      ".bil", ".flt",     ".png"};
/// What lies beside a raster and is read with it, or means nothing by itself.
constexpr std::string_view kBeside[] = {".hdr", ".prj", ".tfw", ".tifw", ".pgw", ".wld",
                                        ".blw", ".bpw", ".clr", ".stx",  ".xml", ".ovr",
                                        ".msk", ".ige", ".rrd", ".rde",  ".aux"};
constexpr std::string_view kRaw[] = {".bil", ".bip", ".bsq", ".flt", ".dem", ".bin", ".raw"};
constexpr std::size_t kLongestList = 64 << 20;  // bytes

bool ends_in(std::string_view name, std::span<const std::string_view> endings) {
  const std::string low = lower_case(name);
  return std::ranges::any_of(endings, [&](auto ending) { return low.ends_with(ending); });
}

bool is_picture(const std::string& path) { return lower_case(path).ends_with(".png"); }

/// Fails where it cannot be told, or a link leads nowhere: its part of the DEM would be missing,
/// and nobody would say so.
Result<bool> is_file_there(const fs::directory_entry& entry) {
  std::error_code error, ignored;
  const auto type = entry.status(error).type();
  if (type == fs::file_type::none)
    return fail(Errc::io, entry.path().string() + ": cannot be looked at: " + error.message());
  if (type == fs::file_type::not_found && entry.is_symlink(ignored))
    return fail(Errc::not_found, entry.path().string() + ": is a link to what is not there");
  return type == fs::file_type::regular;
}

Result<void> add_folder(const std::string& folder, const DemOptions& options, DemFiles& out) {
  std::error_code error;
  if (fs::exists(fs::path(folder) / "layer.json", error))
    return fail(Errc::not_found, folder +
                                     ": is a folder of tiles (it has a layer.json), not of "
                                     "rasters");
  std::vector<std::string> rasters, pictures;
  std::size_t others = 0;
  fs::directory_iterator it(folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string name = it->path().filename().string();
    std::error_code none;
    if (name.starts_with('.')) continue;
    const bool is_named_so = has_raster_ending(name, options.allow_vrt);
    const auto is_raster = is_named_so ? is_file_there(*it) : false;
    if (!is_raster) return std::unexpected(is_raster.error());
    if (!*is_raster)
      others += it->is_directory(none) || !ends_in(name, kBeside);
    else
      (is_picture(name) ? pictures : rasters).push_back(it->path().string());
  }
  if (error) return fail(Errc::io, folder + ": cannot be listed: " + error.message());
  if (rasters.empty())
    rasters = std::move(pictures);
  else
    others += pictures.size();
  if (rasters.empty())
    return fail(
        Errc::not_found,
        fmt::format("{}: is a folder without a raster; looked for {}; folders in it are not "
                    "looked into",
                    folder, fmt::join(kRasterEndings, ", ")));
  if (others > 0)
    out.warnings.push_back(
        fmt::format("{}: {} of its {} entries are no DEMs by their names, and "
                    "left out",
                    folder, others, others + rasters.size()));
  std::ranges::sort(rasters);
  std::ranges::move(rasters, std::back_inserter(out.files));
  return {};
}

std::string trimmed(std::string_view line) {
  const auto first = line.find_first_not_of(" \t\r"), last = line.find_last_not_of(" \t\r");
  return first == line.npos ? std::string() : std::string(line.substr(first, last - first + 1));
}

Result<void> add_list(const std::string& list, const DemOptions& options, DemFiles& out) {
  std::error_code error;
  if (!fs::is_regular_file(list, error))
    return fail(Errc::not_found, "@" + list + ": there is no such list of files");
  if (fs::file_size(list, error) > kLongestList)
    return fail(Errc::out_of_range, list + ": is too long for a list of files");
  const auto text = read_whole_file(list);
  if (!text) return std::unexpected(text.error());
  std::string_view rest(*text);
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  if (rest.find('\0') != rest.npos)
    return fail(Errc::bad_data, list + ": is no text; a list has one file name a line");
  const std::size_t before = out.files.size();
  for (int number = 1; !rest.empty(); ++number) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    std::string name = trimmed(line);
    if (name.empty() || name[0] == '#') continue;
    const std::string here = fmt::format("{}, line {}", list, number);
    if (name[0] == '@') return fail(Errc::bad_data, here + ": a list cannot name a list");
    const fs::path beside = fs::path(list).parent_path() / name;
    if (is_remote_dem(name)) {
      out.files.push_back(std::move(name));
      continue;
    }
    auto there = is_there(name);
    if (there && !*there) {
      there = is_there(beside.string());
      if (there && *there) name = beside.string();
    }
    if (!there) return fail(here, there.error());
    if (!*there)
      return fail(Errc::not_found,
                  fmt::format("{}: there is no {}, neither here nor beside the list", here, name));
    if (!fs::is_directory(name, error))
      out.files.push_back(std::move(name));
    else if (auto ok = add_folder(name, options, out); !ok)
      return fail(here, ok.error());
  }
  if (out.files.size() == before)
    return fail(Errc::not_found, list + ": names no file; a list has one a line");
  return {};
}

/// What is named again has nothing to add: where files overlap, the first one counts.
void keep_first(DemFiles& out) {
  std::unordered_set<std::string_view> seen;
  std::vector<std::string> files;
  std::string again;
  for (const std::string& file : out.files) {
    if (seen.insert(file).second)
      files.push_back(file);
    else if (again.empty())
      again = file;
  }
  if (again.empty()) return;
  const std::size_t repeated = out.files.size() - files.size();
  out.warnings.push_back(
      repeated == 1
          ? again + ": is named twice, and counts once"
          : fmt::format("{}: is named again, and {} more; each counts once", again, repeated - 1));
  out.files = std::move(files);
}

}  // namespace

bool is_dem_folder(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error) || fs::exists(fs::path(path) / "layer.json", error))
    return false;
  fs::directory_iterator it(path, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with('.') || !has_raster_ending(name, true)) continue;
    if (is_file_there(*it).value_or(true)) return true;  // who reads it says what is wrong with it
  }
  return bool(error);  // who reads it says that it cannot be looked into
}

bool is_remote_dem(const std::string& name) {
  return remote::is_remote(name) &&
         (lower_case(name).ends_with(".tif") || lower_case(name).ends_with(".tiff"));
}

bool has_raster_ending(const std::string& name, bool allow_vrt) {
  return ends_in(name, kRasterEndings) || (allow_vrt && lower_case(name).ends_with(".vrt"));
}

Result<DemFiles> dem_files(std::span<const std::string> named, const DemOptions& options) {
  DemFiles out;
  std::error_code error;
  for (const std::string& name : named) {
    if (name.starts_with('@')) {
      if (auto ok = add_list(name.substr(1), options, out); !ok) return std::unexpected(ok.error());
    } else if (fs::is_directory(name, error)) {
      if (auto ok = add_folder(name, options, out); !ok) return std::unexpected(ok.error());
    } else {
      out.files.push_back(name);
    }
  }
  keep_first(out);
  return out;
}

bool is_raw_raster(std::string_view name) { return ends_in(name, kRaw); }

std::vector<std::string> may_come_beside(const std::string& raster) {
  constexpr std::string_view kWithoutPlace[] = {".asc", ".png"}, kZip[] = {".zip"};
  if (is_remote_dem(raster) || ends_in(raster, kZip)) return {};
  std::vector<std::string> names = {raster + ".msk"};
  const std::string stem = fs::path(raster).replace_extension().string();
  if (is_raw_raster(raster) || ends_in(raster, kWithoutPlace)) names.push_back(stem + ".prj");
  if (is_picture(raster))
    for (const char* const world : {".pgw", ".wld"}) names.push_back(stem + world);
  return names;
}

}  // namespace tind
