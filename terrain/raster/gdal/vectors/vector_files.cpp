// GeoPackages and other SQLite databases stay where they are: SQLite says itself that it cannot
// read, and a log that is not yet part of the database (-wal) needs memory that is shared with who
// writes it, which there is not below /vsimem/.
//
// GDAL takes a .gfs for outdated that is older than its .gml. All in memory is of about the same
// second; so the .gml is put there first, and such a .gfs never.

#include "terrain/raster/gdal/vectors/vector_files.h"

#include <cpl_vsi.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <set>
#include <string_view>
#include <utility>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_there.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/lower_case.h"
#include "terrain/base/lower_extension.h"
#include "terrain/base/whole_io.h"

namespace tind::gdal {

namespace fs = std::filesystem;

struct VectorFiles::Found {
  std::string path;
  Descriptor file;
  std::uint64_t size = 0;
  std::int64_t written_s = 0;
};

namespace {

using Endings = std::vector<std::string>;
struct FreeBytes {
  void operator()(char* bytes) const { VSIFree(bytes); }
};
using HeldBytes = std::unique_ptr<char, FreeBytes>;

const Endings kShapefile = {".shp", ".shx", ".dbf", ".prj", ".cpg", ".qix"};
const Endings kMapInfo = {".tab", ".dat", ".dbf", ".map", ".id", ".ind", ".mif", ".mid"};
const Endings kCsv = {".csvt", ".prj"};
const Endings kGml = {".xsd", ".gfs"};

bool is_one_of(const std::string& ending, std::initializer_list<std::string_view> endings) {
  return std::ranges::find(endings, ending) != endings.end();
}
bool is_mapinfo(const std::string& ending) { return is_one_of(ending, {".tab", ".mif", ".mid"}); }

/// What is opened with a file of this ending. GML can have any.
Endings endings_beside(const std::string& ending) {
  if (is_one_of(ending, {".shp", ".shx", ".dbf"})) return kShapefile;
  if (ending == ".tab") return kMapInfo;
  if (is_mapinfo(ending)) return {".mif", ".mid"};
  if (is_one_of(ending, {".csv", ".tsv", ".txt"})) return kCsv;
  if (is_one_of(ending, {".geojson", ".geojsonl", ".json", ".topojson", ".fgb", ".kml", ".gpx",
                         ".dxf", ".gpkg", ".sqlite", ".db"}))
    return {};
  return kGml;
}

/// The names that GDAL tries beside `path`, whether there are such files or not.
std::vector<std::string> names_beside(const std::string& path) {
  std::vector<std::string> names;
  const auto add = [&](std::string name) {
    if (name != path && std::ranges::find(names, name) == names.end())
      names.push_back(std::move(name));
  };
  const std::string own = lower_extension(path);
  const Endings endings = endings_beside(own);
  for (const std::string& ending : endings) {
    add(fs::path(path).replace_extension(ending).string());
    add(fs::path(path).replace_extension(upper_case(ending)).string());
  }
  if (!is_mapinfo(own)) return names;
  // Those of MapInfo are found in letters of any case.
  const fs::path folder = fs::path(path).parent_path();
  const auto entries = entries_of(folder.empty() ? "." : folder.string());
  const std::string stem = lower_case(fs::path(path).stem().string());
  if (!entries) return names;  // then GDAL does not find them, either
  for (const fs::directory_entry& entry : *entries)
    if (lower_case(entry.path().stem().string()) == stem &&
        std::ranges::find(endings, lower_extension(entry.path().string())) != endings.end())
      add((folder / entry.path().filename()).string());
  return names;
}

/// What GDAL may open in a folder: where it has Shapefiles, these only.
Result<std::vector<std::string>> names_in(const std::string& folder) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  const auto add = [&](std::initializer_list<std::string_view> endings, std::set<std::string>& to) {
    for (const fs::directory_entry& entry : *entries) {
      const std::string name = entry.path().string();
      if (!is_one_of(lower_extension(name), endings)) continue;
      to.insert(name);
      for (std::string& beside : names_beside(name)) to.insert(std::move(beside));
    }
  };
  std::set<std::string> names;
  add({".shp"}, names);
  if (names.empty()) add({".tab", ".mif", ".csv", ".dbf"}, names);
  return std::vector<std::string>(names.begin(), names.end());
}

std::unexpected<Error> cannot_read(const std::string& path, int code) {
  return fail(Errc::io, "cannot read " + path + ": " + errno_text(code));
}

Result<void> read_through(int file, const std::string& path) {
  if (const int code = read_to_end(file)) return cannot_read(path, code);
  return {};
}

Result<void> read_through(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return cannot_read(path, errno);
  return read_through(file.get(), path);
}

Result<bool> is_sqlite(int file, const std::string& path) {
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  char head[kMagic.size()] = {};
  const ReadBytes got = read_up_to(file, 0, head, sizeof head);
  if (got.error != 0) return cannot_read(path, got.error);
  return std::string_view(head, got.size) == kMagic;
}

/// A table of MapInfo's that is made of others, which can lie anywhere.
bool names_others(const std::string& path, std::string_view bytes) {
  if (lower_extension(path) != ".tab") return false;
  const std::string text = lower_case(std::string(bytes));
  return text.find("seamless") != text.npos || text.find("create view") != text.npos ||
         text.find("open table") != text.npos;
}

}  // namespace

VectorFiles::VectorFiles(VectorFiles&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      memory_(std::exchange(other.memory_, {})),
      in_place_(std::move(other.in_place_)) {}

VectorFiles::~VectorFiles() { leave_in_place(); }

Result<VectorFiles> VectorFiles::read(const std::string& path, FileStates* states) {
  VectorFiles files;
  files.path_ = files.target_ = path;
  std::vector<Found> found;
  // What is not there, or is a folder, is passed over.
  const auto find = [&](const std::string& name, bool stated) -> Result<void> {
    struct stat is {};
    if (::stat(name.c_str(), &is) != 0) {
      if (errno == ENOENT || errno == ENOTDIR || errno == ENAMETOOLONG) return {};
      return cannot_read(name, errno);
    }
    if (S_ISDIR(is.st_mode)) return {};
    if (!S_ISREG(is.st_mode))
      return fail(Errc::bad_data, name +
                                      ": is a device or a pipe; what stands beside a vector file "
                                      "is read from files");
    if (states && stated)
      if (auto ok = states->add(name); !ok) return ok;
    Descriptor file(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.get() < 0 || ::fstat(file.get(), &is) != 0) return cannot_read(name, errno);
    found.push_back({name, std::move(file), std::uint64_t(is.st_size), is.st_mtim.tv_sec});
    return {};
  };
  const auto type = file_type_of(path);
  if (!type) return std::unexpected(type.error());
  if (*type == fs::file_type::directory) {
    // One after the other: it may have more files than can be open. Which of them GDAL opens, it
    // says itself.
    const auto names = names_in(path);
    if (!names) return std::unexpected(names.error());
    for (const std::string& name : *names) {
      const auto one = file_type_of(name);
      if (!one) return std::unexpected(one.error());
      if (*one != fs::file_type::regular) continue;
      if (auto ok = find(name, false); !ok) return std::unexpected(ok.error());
      if (found.empty()) continue;
      if (auto ok = read_through(found[0].file.get(), name); !ok)
        return std::unexpected(ok.error());
      found.clear();
      files.in_place_.push_back(name);
    }
    return files;
  }
  if (*type == fs::file_type::not_found) return files;
  if (*type != fs::file_type::regular)
    return fail(Errc::bad_data, path + ": is a device or a pipe; lines are read from a file");
  if (auto ok = find(path, true); !ok) return std::unexpected(ok.error());
  if (found.empty()) return files;  // it is gone by now
  for (const std::string& name : names_beside(path))
    if (auto ok = find(name, true); !ok) return std::unexpected(ok.error());
  const auto sqlite = is_sqlite(found[0].file.get(), path);
  if (!sqlite) return std::unexpected(sqlite.error());
  std::uint64_t bytes = 0;
  for (const Found& one : found) bytes += one.size;
  if (!*sqlite && bytes <= kMostInMemory) {
    static std::atomic<unsigned> count{0};
    files.memory_ = fmt::format("/vsimem/tind-vectors/{}/", ++count);
  }
  if (*sqlite)  // theirs is SQLite's to say whether they are as they were
    for (const char* const end : {"-wal", "-journal"})
      if (auto ok = find(path + end, false); !ok) return std::unexpected(ok.error());
  if (auto ok = files.read_all(found); !ok) return std::unexpected(ok.error());
  return files;
}

void VectorFiles::leave_in_place() {
  if (!memory_.empty()) VSIRmdirRecursive(memory_.substr(0, memory_.size() - 1).c_str());
  memory_.clear();
}

Result<void> VectorFiles::read_all(std::vector<Found>& found) {
  for (Found& one : found) {
    in_place_.push_back(one.path);
    if (memory_.empty()) {
      if (auto ok = read_through(one.file.get(), one.path); !ok) return ok;
      continue;
    }
    const std::size_t size = std::size_t(one.size);
    HeldBytes bytes(static_cast<char*>(VSIMalloc(size + 1)));
    if (!bytes) return fail(Errc::io, one.path + ": no memory to read it");
    const ReadBytes got = read_up_to(one.file.get(), 0, bytes.get(), size + 1);
    if (got.error != 0) return cannot_read(one.path, got.error);
    // What the system makes up as it is read (/proc) has more than its size.
    if (got.size > size || (&one == found.data() && names_others(path_, {bytes.get(), got.size}))) {
      bytes.reset();
      leave_in_place();
      if (auto ok = read_through(one.file.get(), one.path); !ok) return ok;
      continue;
    }
    one.file.close();
    if (lower_extension(one.path) == ".gfs" && one.written_s < found[0].written_s) continue;
    const std::string name = memory_ + fs::path(one.path).filename().string();
    VSILFILE* const made =
        VSIFileFromMemBuffer(name.c_str(), reinterpret_cast<GByte*>(bytes.get()), got.size, TRUE);
    if (!made) return fail(Errc::io, one.path + ": no memory to read it");
    static_cast<void>(bytes.release());
    VSIFCloseL(made);
  }
  if (memory_.empty()) return {};
  target_ = memory_ + fs::path(path_).filename().string();
  in_place_.clear();
  return {};
}

std::string VectorFiles::shown(std::string text) const {
  if (memory_.empty()) return text;
  const std::string before =
      path_.substr(0, path_.size() - fs::path(path_).filename().string().size());
  const std::string folder = memory_.substr(0, memory_.size() - 1);
  for (auto at = text.find(folder); at != text.npos; at = text.find(folder, at)) {
    const bool file = text.compare(at, memory_.size(), memory_) == 0;
    const std::string with = file || !before.empty() ? before : ".";
    text.replace(at, file ? memory_.size() : folder.size(), with);
    at += with.size();
  }
  return text;
}

std::uint64_t VectorFiles::size_of(const std::string& name) const {
  if (!memory_.empty() && name.starts_with(memory_)) {
    VSIStatBufL is;
    return VSIStatL(name.c_str(), &is) == 0 ? std::uint64_t(is.st_size) : 0;
  }
  std::error_code error;
  const auto size = fs::file_size(name, error);
  return error ? 0 : size;
}

Result<void> VectorFiles::still_readable() const {
  for (const std::string& name : in_place_)
    if (auto ok = read_through(name); !ok) {
      std::error_code error;
      if (fs::exists(name, error) || error) return ok;  // a log of SQLite's may be gone by now
    }
  return {};
}

}  // namespace tind::gdal
