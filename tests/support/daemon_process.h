#pragma once
// The program as a daemon, as whoever began it sees it.

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>

#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind::test {

/// `tind serve` of a small DEM, which ends with this at the latest.
class DaemonProcess {
 public:
  /// `before`: done in the new process first.
  explicit DaemonProcess(const std::function<void()>& before = {}) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return;
    ::setenv("TIND_AS_ROOT", "true", 0);
    const std::string program = tind_binary(), dem = testdata("rainier.tif");
    const std::string indexes = folder_.file("indexes");
    process_ = ::fork();
    if (process_ == 0) {
      ::dup2(ends[1], STDOUT_FILENO);
      ::dup2(ends[1], STDERR_FILENO);
      if (before) before();
      ::execl(program.c_str(), program.c_str(), "serve", dem.c_str(), "--listen", "127.0.0.1:0",
              "--index-dir", indexes.c_str(), "--jobs", "0", nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    output_ = ends[0];
  }
  ~DaemonProcess() {
    if (process_ > 0) {
      ::kill(process_, SIGKILL);
      ::waitpid(process_, nullptr, 0);
    }
    if (output_ >= 0) ::close(output_);
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  /// Waits until it has said so; false where it has ended without.
  bool says(const std::string& words) {
    std::array<char, 4096> part;
    while (said_.find(words) == said_.npos) {
      const ssize_t size = ::read(output_, part.data(), part.size());
      if (size <= 0) return false;
      said_.append(part.data(), std::size_t(size));
    }
    return true;
  }
  void hears(int signal) const { ::kill(process_, signal); }
  /// Its status where it has ended.
  bool has_ended(int& status) {
    if (::waitpid(process_, &status, WNOHANG) != process_) return false;
    process_ = -1;
    return true;
  }
  /// Its exit code once it has ended; -1 where a signal has ended it.
  int exit_code() {
    int status = 0;
    while (!has_ended(status)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  const std::string& said() const { return said_; }

 private:
  TempDir folder_;
  pid_t process_ = -1;
  int output_ = -1;
  std::string said_;
};

}  // namespace tind::test
