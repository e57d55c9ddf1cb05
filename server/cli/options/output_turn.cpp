#include "server/cli/options/output_turn.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <thread>

namespace tind::cli {

Result<OutputTurn> OutputTurn::take(const std::string& file) {
  using namespace std::chrono_literals;
  const auto parent = std::filesystem::path(file).parent_path();
  const std::string name = parent.empty() ? "." : parent.string();
  Descriptor folder(::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (folder.get() >= 0 && ::flock(folder.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) break;
    if (std::chrono::steady_clock::now() > end)
      return fail(Errc::busy, "another program keeps " + name +
                                  " locked, into which files are to come together: try again");
    std::this_thread::sleep_for(5ms);
  }
  return OutputTurn(std::move(folder));
}

}  // namespace tind::cli
