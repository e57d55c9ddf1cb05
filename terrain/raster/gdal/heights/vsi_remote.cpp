// A file system of GDAL's in which a name is known only as long as we say so. It lists nothing and
// has no file beside another, so that a raster cannot make us look for more.

#include "terrain/raster/gdal/heights/vsi_remote.h"

#include <cpl_conv.h>
#include <cpl_vsi.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <span>
#include <string_view>

namespace tind::gdal {

namespace {

using File = std::shared_ptr<const remote::RemoteFile>;

constexpr const char* kPrefix = "/vsitind/";

thread_local std::optional<Error> first_failure;

class Mounts {
 public:
  static Mounts& all() {
    static Mounts mounts;
    return mounts;
  }
  std::string add(File file) {
    const std::lock_guard lock(mutex_);
    const std::string name = std::to_string(count_++) + "/remote.tif";
    files_[name] = std::move(file);
    return kPrefix + name;
  }
  void remove(const std::string& name) {
    const std::lock_guard lock(mutex_);
    files_.erase(name.substr(std::string_view(kPrefix).size()));
  }
  File find(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    const auto found = files_.find(name);
    return found == files_.end() ? nullptr : found->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, File> files_;  // by names without the prefix, as GDAL asks for them
  std::uint64_t count_ = 0;
};

struct Handle {
  File file;
  vsi_l_offset at = 0;
  bool at_end = false;
};

int stat_file(void*, const char* name, VSIStatBufL* to, int) {
  std::memset(to, 0, sizeof *to);
  const File file = Mounts::all().find(name);
  if (!file) {
    errno = ENOENT;
    return -1;
  }
  to->st_mode = S_IFREG | S_IRUSR;
  to->st_size = decltype(to->st_size)(file->size());
  return 0;
}

void* open_file(void*, const char* name, const char* access) {
  File file = Mounts::all().find(name);
  if (!file || std::string_view(access).find_first_of("wa+") != std::string_view::npos) {
    errno = file ? EACCES : ENOENT;
    return nullptr;
  }
  return new Handle{std::move(file)};
}

int seek_file(void* opened, vsi_l_offset to, int whence) {
  auto& handle = *static_cast<Handle*>(opened);
  handle.at_end = false;
  handle.at = whence == SEEK_SET   ? to
              : whence == SEEK_CUR ? handle.at + to
                                   : vsi_l_offset(handle.file->size()) + to;
  return 0;
}

size_t read_file(void* opened, void* to, size_t one, size_t count) {
  auto& handle = *static_cast<Handle*>(opened);
  const std::uint64_t size = handle.file->size();
  if (one == 0 || count == 0) return 0;
  const std::uint64_t left = handle.at < size ? size - handle.at : 0;
  const std::size_t bytes = std::size_t(std::min<std::uint64_t>(left, std::uint64_t(one) * count));
  handle.at_end = bytes < one * count;
  const auto done =
      handle.file->read_kept(handle.at, std::span(static_cast<std::uint8_t*>(to), bytes));
  if (!done) {
    if (!first_failure) first_failure = done.error();
    return 0;
  }
  handle.at += bytes;
  return bytes / one;
}

void install() {
  static std::once_flag once;
  std::call_once(once, [] {
    VSIFilesystemPluginCallbacksStruct* const calls = VSIAllocFilesystemPluginCallbacksStruct();
    calls->stat = stat_file;
    calls->open = open_file;
    calls->tell = [](void* opened) { return static_cast<Handle*>(opened)->at; };
    calls->seek = seek_file;
    calls->read = read_file;
    calls->eof = [](void* opened) { return int(static_cast<Handle*>(opened)->at_end); };
    calls->close = [](void* opened) {
      delete static_cast<Handle*>(opened);
      return 0;
    };
    calls->sibling_files = [](void*, const char*) {
      return static_cast<char**>(CPLCalloc(1, sizeof(char*)));
    };
    VSIInstallPluginHandler(kPrefix, calls);
    VSIFreeFilesystemPluginCallbacksStruct(calls);
  });
}

}  // namespace

RemoteMount::RemoteMount(File file) : file_(std::move(file)) {
  install();
  name_ = Mounts::all().add(file_);
}

RemoteMount::~RemoteMount() { Mounts::all().remove(name_); }

RemoteFailures::RemoteFailures() { first_failure.reset(); }
RemoteFailures::~RemoteFailures() { first_failure.reset(); }
const std::optional<Error>& RemoteFailures::first() const { return first_failure; }

}  // namespace tind::gdal
