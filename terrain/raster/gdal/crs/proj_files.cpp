// GDAL makes contexts of PROJ of its own, which nobody can reach, and they have PROJ's default file
// functions, whatever its default context has. So the two functions that make contexts are ours:
// the program's symbols come before those of its libraries. They call PROJ's and set the functions.
// Files are compared by their real paths, so neither ".." nor a link leads out of a folder. PROJ's
// database is not among them: SQLite opens that.

#include "terrain/raster/gdal/crs/proj_files.h"

#include <dlfcn.h>
#include <proj.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrain/base/system_failure.h"

namespace tind::gdal {
namespace {

namespace fs = std::filesystem;

thread_local int operators = 0;  // OperatorNamesGrids that live
thread_local std::optional<UnreadGrid> unread;

/// The first counts. PROJ also looks where this user may not (a home of somebody else's).
void note_unread(int code, const std::string& file) {
  if (is_system_failure(code) && !unread) unread = UnreadGrid{code, file};
}

struct Named {
  std::mutex mutex;
  std::set<fs::path> files;
};
Named& named() {
  static Named all;
  return all;
}

fs::path real(const fs::path& path) {
  std::error_code error;
  fs::path found = fs::weakly_canonical(path, error);
  note_unread(error.value(), path.string());
  return error ? fs::path() : found;
}

bool lies_in(const fs::path& file, const fs::path& folder) {
  if (folder.empty()) return false;
  const auto [end, ignored] = std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
  return end == folder.end() || (end->empty() && std::next(end) == folder.end());
}

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

std::vector<fs::path> searched_folders() {
  std::vector<fs::path> found;
  const char* const path = proj_info().searchpath;
  for (std::string_view rest = path ? path : ""; !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find(':'));
    if (!one.empty()) found.push_back(real(one));
    rest.remove_prefix(std::min(one.size() + 1, rest.size()));
  }
  return found;
}

/// PROJ's own folders, as it would search them: asked again where the environment says others.
bool lies_in_own_folder(const fs::path& file) {
  static std::mutex mutex;
  static std::string of;
  static std::vector<fs::path> folders;
  const std::lock_guard lock(mutex);
  const std::string now = variable("PROJ_DATA") + "\n" + variable("PROJ_LIB");
  if (folders.empty() || of != now) folders = searched_folders(), of = now;
  return std::ranges::any_of(folders, [&](const fs::path& own) { return lies_in(file, own); });
}

bool may_open(const char* name, const void* folder) {
  const fs::path file = real(name);
  if (file.empty()) return false;
  if (folder && lies_in(file, real(*static_cast<const std::string*>(folder)))) return true;
  if (lies_in_own_folder(file)) return true;
  Named& all = named();
  const std::lock_guard lock(all.mutex);
  if (operators > 0) all.files.insert(file);
  return all.files.contains(file);
}

std::FILE* file_of(PROJ_FILE_HANDLE* handle) { return reinterpret_cast<std::FILE*>(handle); }

PROJ_FILE_HANDLE* open_file(PJ_CONTEXT*, const char* name, PROJ_OPEN_ACCESS access, void* folder) {
  if (access != PROJ_OPEN_ACCESS_READ_ONLY || !may_open(name, folder)) return nullptr;
  std::FILE* const file = std::fopen(name, "rb");
  if (!file) note_unread(errno, name);
  return reinterpret_cast<PROJ_FILE_HANDLE*>(file);
}
std::size_t read_file(PJ_CONTEXT*, PROJ_FILE_HANDLE* file, void* to, std::size_t size, void*) {
  const std::size_t got = std::fread(to, 1, size, file_of(file));
  if (got < size && std::ferror(file_of(file)) != 0) note_unread(EIO, "a grid of PROJ's");
  return got;
}
std::size_t write_file(PJ_CONTEXT*, PROJ_FILE_HANDLE*, const void*, std::size_t, void*) {
  return 0;
}
int seek_file(PJ_CONTEXT*, PROJ_FILE_HANDLE* file, long long offset, int whence, void*) {
  return fseeko(file_of(file), offset, whence) == 0;
}
unsigned long long tell_file(PJ_CONTEXT*, PROJ_FILE_HANDLE* file, void*) {
  return static_cast<unsigned long long>(ftello(file_of(file)));
}
void close_file(PJ_CONTEXT*, PROJ_FILE_HANDLE* file, void*) { std::fclose(file_of(file)); }
int file_exists(PJ_CONTEXT*, const char* name, void* folder) {
  std::error_code error;
  if (!may_open(name, folder)) return 0;
  const bool there = fs::exists(name, error);
  note_unread(error.value(), name);
  return there;
}
int no(PJ_CONTEXT*, const char*, void*) { return 0; }
int no_rename(PJ_CONTEXT*, const char*, const char*, void*) { return 0; }

constexpr PROJ_FILE_API kFiles = {.version = 1,
                                  .open_cbk = open_file,
                                  .read_cbk = read_file,
                                  .write_cbk = write_file,
                                  .seek_cbk = seek_file,
                                  .tell_cbk = tell_file,
                                  .close_cbk = close_file,
                                  .exists_cbk = file_exists,
                                  .mkdir_cbk = no,
                                  .unlink_cbk = no,
                                  .rename_cbk = no_rename};

}  // namespace

std::optional<UnreadGrid> take_unread_grid() { return std::exchange(unread, std::nullopt); }

void allow_folder(PJ_CONTEXT* context, const std::string& folder) {
  proj_context_set_fileapi(context, &kFiles, const_cast<std::string*>(&folder));
}

OperatorNamesGrids::OperatorNamesGrids() { ++operators; }
OperatorNamesGrids::~OperatorNamesGrids() { --operators; }

/// New contexts are copies of PROJ's own, to which proj_info() writes, without a lock, what that
/// has not yet: once, and before anybody copies it.
void fill_in_own_context() {
  static const PJ_INFO info = proj_info();
  (void)info;
}

PJ_CONTEXT* guarded(PJ_CONTEXT* context) {
  if (context) proj_context_set_fileapi(context, &kFiles, nullptr);
  return context;
}

}  // namespace tind::gdal

extern "C" {

PJ_CONTEXT* proj_context_create() {
  using Make = PJ_CONTEXT*();
  static auto* const make = reinterpret_cast<Make*>(dlsym(RTLD_NEXT, "proj_context_create"));
  tind::gdal::fill_in_own_context();
  return tind::gdal::guarded(make());
}

PJ_CONTEXT* proj_context_clone(PJ_CONTEXT* from) {
  using Clone = PJ_CONTEXT*(PJ_CONTEXT*);
  static auto* const clone = reinterpret_cast<Clone*>(dlsym(RTLD_NEXT, "proj_context_clone"));
  tind::gdal::fill_in_own_context();
  return tind::gdal::guarded(clone(from));
}
}
