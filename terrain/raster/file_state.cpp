// A write sets the time before it changes a byte. So a look at the time after reading tells whether
// a byte that was read can have been written since; a look before reading would tell nothing. What
// stays unseen: one that sets the old time again, and the rest of a write() that had begun before
// the file was opened.

#include "terrain/raster/file_state.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <ctime>
#include <thread>

#include "terrain/base/errno_text.h"

namespace tind {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
/// FAT counts in steps of 2 s, older file systems in whole seconds.
constexpr std::int64_t kCoarseTick = 2 * kSecond;

std::int64_t nanoseconds(const timespec& t) { return t.tv_sec * kSecond + t.tv_nsec; }

/// Two ticks of the kernel's clock for files, of 1 to 10 ms each.
std::int64_t fine_tick() {
  timespec tick{};
  return ::clock_getres(CLOCK_REALTIME_COARSE, &tick) == 0 ? 2 * nanoseconds(tick) : kSecond / 50;
}

/// Until a write would be seen by its time. A time in the future (another machine's clock) is not
/// waited for.
void wait_past(std::int64_t written_ns) {
  using namespace std::chrono;
  const std::int64_t tick = written_ns % kSecond == 0 ? kCoarseTick : fine_tick();
  const std::int64_t now =
      duration_cast<std::chrono::nanoseconds>(system_clock::now().time_since_epoch()).count();
  if (now >= written_ns && now < written_ns + tick)
    std::this_thread::sleep_for(std::chrono::nanoseconds(written_ns + tick - now));
}

std::string what_happened(const FileState& before, const FileState& now) {
  if (before.device != now.device || before.inode != now.inode) return "was replaced by another";
  if (now.size < before.size) return "became shorter";
  if (now.size > before.size) return "became longer";
  return "was written to";
}

}  // namespace

Result<FileState> file_state(const std::string& path) {
  struct stat s {};
  if (::stat(path.c_str(), &s) != 0)
    return fail(
        Errc::io,
        path + ": " + (errno == ENOENT ? std::string("is no longer there") : errno_text(errno)));
  return FileState{s.st_dev, s.st_ino, std::uint64_t(s.st_size), nanoseconds(s.st_mtim),
                   nanoseconds(s.st_ctim)};
}

Result<void> FileStates::add(const std::string& path) {
  auto state = file_state(path);
  if (!state) return std::unexpected(state.error());
  wait_past(state->written_ns);
  // Once more: it may have been written to while we waited, and then nothing was read of it yet.
  state = file_state(path);
  if (!state) return std::unexpected(state.error());
  entries_.push_back({path, *state});
  return {};
}

void FileStates::expect_none(const std::string& path) {
  if (::access(path.c_str(), F_OK) != 0) absent_.push_back(path);
}

Result<void> FileStates::unchanged() const {
  const std::string remedy(kChangedRemedy);
  for (const Entry& entry : entries_) {
    const auto now = file_state(entry.path);
    if (!now) return fail(Errc::io, now.error().what + remedy);
    if (!entry.state.same_content(*now))
      return fail(Errc::io, entry.path + ": " + what_happened(entry.state, *now) + remedy);
  }
  for (const std::string& path : absent_)
    if (::access(path.c_str(), F_OK) == 0)
      return fail(Errc::io, path + ": was put beside the raster" + remedy);
  return {};
}

}  // namespace tind
