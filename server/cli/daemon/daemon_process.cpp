#include "server/cli/daemon/daemon_process.h"

#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <thread>

#include "terrain/base/folder_entries.h"

namespace tind::cli {
namespace {

constexpr std::size_t kSpareDescriptors = 192;  // DEM files, logs, libraries, a few connections

std::atomic<bool> hung_up = false;

/// Folders of tiles keep theirs.
std::size_t open_descriptors() {
  const auto all = entries_of("/proc/self/fd");
  return all ? all->size() : 0;
}

}  // namespace

void ignore_signals() {
  for (const int signal : {SIGPIPE, SIGUSR1, SIGUSR2}) std::signal(signal, SIG_IGN);
  std::signal(SIGHUP, [](int) { hung_up = true; });
  // The first process of a container has no default actions: it would be deaf until it listens.
  if (::getpid() == 1)
    for (const int signal : {SIGTERM, SIGINT})
      std::signal(signal, [](int number) { std::_Exit(128 + number); });
}

bool has_hung_up() { return hung_up; }

bool has_terminal() {
  const int terminal = ::open("/dev/tty", O_RDONLY | O_CLOEXEC | O_NOCTTY);
  if (terminal >= 0) ::close(terminal);
  return terminal >= 0;
}

void end_within(std::chrono::milliseconds time, int code) {
  const auto end = [time, code] {
    std::this_thread::sleep_for(time);
    constexpr std::string_view kWords = "tind: a worker did not stop in time and is abandoned\n";
    pollfd ready{2, POLLOUT, 0};
    if (::poll(&ready, 1, 0) > 0) [[maybe_unused]]
      const ssize_t size = ::write(2, kWords.data(), kWords.size());
    ::_exit(code);
  };
  try {
    std::thread(end).detach();
  } catch (const std::system_error&) {  // NOLINT(bugprone-empty-catch): as the header says
  }
}

void bound_memory() {
  // NOLINTBEGIN(concurrency-mt-unsafe): no other thread asks the environment yet
  mallopt(M_ARENA_MAX, 2);
  // A tile's work space stays for the next one: to take its pages anew each time was two thirds of
  // a cold tile's time. What is larger (a body, an index) goes back when it is done with.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 32 << 20);
  setenv("GDAL_CACHEMAX", "16", 0);  // MB; the operator's own setting wins
  // NOLINTEND(concurrency-mt-unsafe)
}

std::size_t connections_within_limits(std::size_t wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return wanted;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::size_t spare =
      std::min<std::size_t>(kSpareDescriptors + open_descriptors(), limit.rlim_cur / 2);
  return std::min<std::size_t>(wanted, limit.rlim_cur - spare);
}

}  // namespace tind::cli
