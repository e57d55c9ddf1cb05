#include "server/services/jobs/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>
#include <utility>
#include <vector>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/resource_limit.h"

namespace tind::services {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kLook = 50ms;       // how often a child is looked after
constexpr auto kPatience = 300ms;  // from SIGTERM to SIGKILL
constexpr std::size_t kLongestLine = 4096;
constexpr std::string_view kNoLimits =
    "tind: no limits can be set for it: whoever runs the daemon lets it have prlimit64, or jobs = "
    "0\n";
constexpr int kOfTheOperator = 74;  // EX_IOERR

/// 0: no limit of ours. A job without those that it should have is not begun.
bool limit(int resource, std::size_t most) { return most == 0 || set_limit(resource, most); }

/// In the child, where other threads may have held any lock: system calls only.
[[noreturn]] void become(char* const* arguments, const char* folder, const ChildLimits& limits,
                         int nothing, int errors, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);  // it went before that
  ::setpgid(0, 0);
  ::setpriority(PRIO_PROCESS, 0, limits.niceness);
  const auto seconds = std::size_t(limits.cpu_time.count());
  // SIGXCPU first, which says why; SIGKILL can be anybody's.
  const bool limited =
      limit(RLIMIT_AS, limits.memory_bytes) && limit(RLIMIT_FSIZE, limits.file_bytes) &&
      (seconds == 0 || set_limit(RLIMIT_CPU, seconds, seconds + 1)) && set_limit(RLIMIT_CORE, 0);
  for (const int signal : {SIGPIPE, SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXFSZ, SIGXCPU})
    ::signal(signal, SIG_DFL);  // NOLINT(concurrency-mt-unsafe): there is one thread here
  sigset_t none_blocked;
  ::sigemptyset(&none_blocked);
  ::sigprocmask(SIG_SETMASK, &none_blocked, nullptr);  // NOLINT(concurrency-mt-unsafe): the same
  if (!limited) {
    [[maybe_unused]] const ssize_t size = ::write(errors, kNoLimits.data(), kNoLimits.size());
    ::_exit(kOfTheOperator);
  }
  const bool ready = ::chdir(folder) == 0 && ::dup2(nothing, 0) == 0 && ::dup2(nothing, 1) == 1 &&
                     ::dup2(errors, 2) == 2 && ::close_range(3, ~0u, 0) == 0;
  if (ready) ::execv(arguments[0], arguments);
  ::_exit(127);
}

/// Bytes as they come, lines as they are heard.
class Lines {
 public:
  explicit Lines(const std::function<void(std::string_view)>& heard) : heard_(heard) {}
  void add(std::string_view bytes) {
    for (const char c : bytes) {
      if (c == '\n' || c == '\r')
        end();
      else if (line_.size() < kLongestLine)
        line_ += c;
    }
  }
  void end() {
    if (!line_.empty() && heard_) heard_(line_);
    line_.clear();
  }

 private:
  const std::function<void(std::string_view)>& heard_;
  std::string line_;
};

/// Reads until the child has ended or closed its end, somebody asks to stop, or the time is over.
/// What the child began itself may hold that end for longer: nobody waits for it. `child` is a
/// descriptor of the process, or -1 where the system has none.
ChildEnd::Why listen(int from, int child, Lines& lines, Clock::time_point end,
                     const std::stop_token& stop) {
  std::array<char, 4096> buffer;
  for (;;) {
    if (stop.stop_requested()) return ChildEnd::Why::stopped;
    if (Clock::now() >= end) return ChildEnd::Why::out_of_time;
    pollfd ready[] = {{from, POLLIN, 0}, {child, POLLIN, 0}};
    if (::poll(ready, 2, int(kLook.count())) <= 0) continue;
    const bool ended = ready[1].revents != 0;  // looked at first: all that it said is there then
    const ssize_t size = ::read(from, buffer.data(), buffer.size());
    if (size > 0)
      lines.add({buffer.data(), std::size_t(size)});
    else if (size == 0 || (errno == EAGAIN ? ended : errno != EINTR))
      return ChildEnd::Why::exited;
  }
}

/// Of a child whose end the system does not tell: nobody knows that it did what it was to do.
constexpr int kUntold = 1 << 8;  // as waitpid() has an exit with 1

/// Its status when it has ended, within some time.
bool ended_within(pid_t child, Clock::duration time, int& status) {
  const auto end = Clock::now() + time;
  for (;;) {
    const pid_t got = ::waitpid(child, &status, WNOHANG);
    if (got == child || (got < 0 && errno != EINTR)) return true;
    if (Clock::now() >= end) return false;
    ::poll(nullptr, 0, 5);
  }
}

/// What a child had begun, and was killed with it, is a child of the system's first process now. Of
/// a container that may be us.
void bury(pid_t group) {
  for (const auto end = Clock::now() + kPatience; Clock::now() < end; ::poll(nullptr, 0, 5)) {
    pid_t got;
    while ((got = ::waitpid(-group, nullptr, WNOHANG)) > 0) {
    }
    if (got < 0) return;  // there is none, or no more
  }
}

}  // namespace

Result<ChildEnd> run_child(std::span<const std::string> arguments, const std::string& folder,
                           const ChildLimits& limits,
                           const std::function<void(std::string_view line)>& heard,
                           const std::stop_token& stop) {
  const auto failed = [](const char* what) {
    return fail(Errc::io, std::string(what) + ": " + errno_text(errno));
  };
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return failed("no pipe for a process");
  Descriptor from(ends[0]), to(ends[1]);
  ::fcntl(from.get(), F_SETFL, O_NONBLOCK);
  const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (nothing.get() < 0) return failed("/dev/null");
  std::vector<char*> words;
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  // Until the child has let go of them, the daemon's handlers are its own, too: a signal would be
  // told to the daemon, as if that were to stop.
  sigset_t all, before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t parent = ::getpid();
  // Not fork(), which first has the child do what libraries have asked for: PROJ's handler waits
  // for a mutex that some other thread may have held, and that nobody in the child ever lets go.
  const auto child = pid_t(::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0));
  const int why = errno;
  if (child != 0) ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = why;
  if (child < 0) return failed("no process");
  if (child == 0) become(words.data(), folder.c_str(), limits, nothing.get(), to.get(), parent);
  ::setpgid(child, child);  // whoever comes first, it or we
  to.close();
  const Descriptor process(int(::syscall(SYS_pidfd_open, child, 0)));

  Lines lines(heard);
  const auto end =
      limits.wall_time.count() > 0 ? Clock::now() + limits.wall_time : Clock::time_point::max();
  ChildEnd result;
  result.why = listen(from.get(), process.get(), lines, end, stop);
  int status = kUntold;
  if (result.why != ChildEnd::Why::exited) ::kill(-child, SIGTERM);
  // One that has closed its standard error and goes on is told to end, too.
  if (!ended_within(child, kPatience, status)) {
    ::kill(-child, SIGKILL);
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  ::kill(-child, SIGKILL);  // what it may have begun itself
  bury(child);
  lines.end();
  if (result.why != ChildEnd::Why::exited) return result;
  if (WIFSIGNALED(status)) return ChildEnd{ChildEnd::Why::killed, WTERMSIG(status)};
  return ChildEnd{ChildEnd::Why::exited, WEXITSTATUS(status)};
}

}  // namespace tind::services
