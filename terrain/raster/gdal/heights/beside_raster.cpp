#include "terrain/raster/gdal/heights/beside_raster.h"

#include <fcntl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_io.h"
#include "terrain/base/lower_case.h"

namespace tind::gdal {
namespace {

namespace fs = std::filesystem;

/// Those that GDAL tries of a raster with a .tif: .tfw, .tifw and .wld, in small letters and large.
std::vector<fs::path> world_files(const fs::path& raster) {
  const std::string own = lower_case(raster.extension().string());
  std::vector<std::string> endings = {".wld"};
  if (own.size() > 1)
    endings.insert(endings.end(), {own.substr(0, 2) + own.back() + "w", own + "w"});
  std::vector<fs::path> files;
  for (const std::string& ending : endings)
    for (const std::string& name : {ending, upper_case(ending)})
      files.push_back(fs::path(raster).replace_extension(name));
  return files;
}

/// With these it has other heights, or another place.
bool means_something(const fs::path& beside) {
  constexpr std::string_view kEndings[] = {".msk", ".aux.xml", ".prj", ".qpj", ".hdr"};
  const std::string name = lower_case(beside.string());
  return std::ranges::any_of(kEndings, [&](auto end) { return name.ends_with(end); });
}

Result<void> look(const fs::path& beside, bool needed) {
  std::error_code error;
  const auto type = fs::status(beside, error).type();
  if (type == fs::file_type::fifo || type == fs::file_type::socket ||
      type == fs::file_type::character || type == fs::file_type::block)
    return fail(Errc::bad_data, beside.string() +
                                    ": is a device or a pipe; what stands beside a raster is "
                                    "read from files");
  if (type == fs::file_type::not_found || !needed) return {};
  const Descriptor file(::open(beside.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0 && errno != ENOENT && errno != ENOTDIR)
    return fail(Errc::io, beside.string() + ": is read with the raster, and cannot be opened: " +
                              errno_text(errno));
  return {};
}

}  // namespace

Result<void> look_beside(const fs::path& raster) {
  constexpr const char* kBehind[] = {".ovr", ".OVR", ".msk", ".MSK", ".msk.ovr", ".aux.xml"};
  constexpr const char* kInstead[] = {".prj", ".PRJ", ".qpj", ".aux", ".AUX", ".aux.xml",
                                      ".ovr", ".OVR", ".msk", ".MSK", ".hdr", ".HDR",
                                      ".clr", ".CLR", ".rrd", ".RRD", ".stx", ".STX",
                                      ".xml", ".XML", ".tab", ".TAB", ".rpb", ".RPB"};
  std::vector<fs::path> beside;
  for (const char* end : kBehind) beside.emplace_back(raster.string() + end);
  for (const char* end : kInstead) beside.push_back(fs::path(raster).replace_extension(end));
  for (const fs::path& file : beside)
    if (auto ok = look(file, means_something(file)); !ok) return ok;
  for (const fs::path& file : world_files(raster))
    if (auto ok = look(file, true); !ok) return ok;
  return {};
}

Result<void> no_world_file(const fs::path& raster) {
  for (const fs::path& file : world_files(raster)) {
    const auto text = read_beginning(file.string(), 4096);
    if (!text && text.error().code == Errc::not_found) continue;
    if (!text) return std::unexpected(text.error());
    std::array<double, 6> a{};
    std::istringstream in(*text);
    in.imbue(std::locale::classic());
    for (double& v : a) in >> v;
    if (!in)
      return fail(Errc::bad_data, file.string() + " is no world file: six numbers, a line each");
    if (a != std::array<double, 6>{1, 0, 0, 1, 0.5, 0.5})
      return fail(Errc::io, file.string() + " could not be read, which says where the raster is");
  }
  return {};
}

}  // namespace tind::gdal
