#include "terrain/raster/sandbox/spawn.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>

#include <cstdlib>
#include <utility>
#include <vector>

#include "terrain/base/errno_text.h"

namespace tind::sandbox {
namespace {

constexpr const char* kKept[] = {"GDAL_CACHEMAX", "GDAL_DATA",       "PROJ_DATA",
                                 "PROJ_LIB",      "LD_LIBRARY_PATH", "ASAN_OPTIONS",
                                 "TSAN_OPTIONS",  "UBSAN_OPTIONS"};

/// What posix_spawn is told.
class Spawning {
 public:
  Spawning() {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawnattr_init(&attributes_);
    sigset_t all, none;
    ::sigfillset(&all);
    ::sigemptyset(&none);
    ::posix_spawnattr_setsigdefault(&attributes_, &all);
    ::posix_spawnattr_setsigmask(&attributes_, &none);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  }
  ~Spawning() {
    ::posix_spawnattr_destroy(&attributes_);
    ::posix_spawn_file_actions_destroy(&actions_);
  }
  Spawning(const Spawning&) = delete;
  Spawning& operator=(const Spawning&) = delete;

  int run(std::span<const std::string> command, const Descriptors& ours, pid_t& process) {
    for (const int fd : {0, 1, 2})
      ::posix_spawn_file_actions_addopen(&actions_, fd, "/dev/null", O_RDWR, 0);
    constexpr Descriptors kTheirs = {kSocket, kShared, kBrief};
    for (std::size_t i = 0; i < ours.size(); ++i) {
      if (ours[i] >= 0) ::posix_spawn_file_actions_adddup2(&actions_, ours[i], kTheirs[i]);
    }
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, kBrief + 1);
    std::vector<char*> words, variables;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    std::vector<std::string> kept;
    for (const char* name : kKept)
      if (const char* value = std::getenv(name)) kept.push_back(std::string(name) + "=" + value);
    for (std::string& one : kept) variables.push_back(one.data());
    variables.push_back(nullptr);
    return ::posix_spawn(&process, words[0], &actions_, &attributes_, words.data(),
                         variables.data());
  }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

}  // namespace

bool move_up(Descriptor& descriptor) {
  Descriptor up(::fcntl(descriptor.get(), F_DUPFD_CLOEXEC, kBrief + 1));
  if (up.get() < 0) return false;
  descriptor = std::move(up);
  return true;
}

Result<pid_t> spawn(std::span<const std::string> command, const Descriptors& descriptors) {
  pid_t process = -1;
  const int error = Spawning().run(command, descriptors, process);
  if (error != 0) return fail(Errc::io, command[0] + ": " + errno_text(error));
  return process;
}

}  // namespace tind::sandbox
