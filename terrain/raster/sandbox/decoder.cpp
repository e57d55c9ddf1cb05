// The shared memory is sealed before the process begins: one that could shrink it would end us with
// SIGBUS. Time is measured by the clock of the process's own processor time, since on a busy
// machine the wall's says nothing; the wall's bound is for one that sleeps.

#include "terrain/raster/sandbox/decoder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <mutex>
#include <utility>
#include <vector>

#include "terrain/base/errno_text.h"
#include "terrain/base/whole_io.h"
#include "terrain/raster/sandbox/spawn.h"

namespace tind::sandbox {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kLook = 250ms;  // how often the clocks are looked at

std::atomic<std::uint64_t> failed_in_all = 0;

std::unexpected<Error> failed(const char* what) {
  return fail(Errc::io, fmt::format("no process to decode in: {}: {}", what, errno_text(errno)));
}

/// Processes that did not end at once when they were killed: they wait for a disk, and whoever
/// waited for them would, too.
class Unburied {
 public:
  static void bury(pid_t process) {
    const std::lock_guard lock(mutex());
    auto& left = all();
    left.push_back(process);
    std::erase_if(left, [](pid_t one) {
      int status = 0;
      return ::waitpid(one, &status, WNOHANG) != 0;
    });
  }

 private:
  static std::mutex& mutex() {
    static std::mutex m;
    return m;
  }
  static std::vector<pid_t>& all() {
    static std::vector<pid_t> left;
    return left;
  }
};

/// Its status, unless it does not end within some time.
bool await(pid_t process, std::chrono::milliseconds time, int& status) {
  for (const auto end = Clock::now() + time;;) {
    const pid_t got = ::waitpid(process, &status, WNOHANG);
    if (got == process) return true;
    if (got < 0 && errno != EINTR) return false;
    if (Clock::now() >= end) return false;
    ::poll(nullptr, 0, 1);
  }
}

/// As strsignal, for every thread.
const char* signal_text(int signal) {
  const char* const text = ::sigdescr_np(signal);
  return text ? text : "unknown";
}

std::string was_ended_by(int signal) {
  return fmt::format("the process that decodes it was ended by signal {} ({})", signal,
                     signal_text(signal));
}

}  // namespace

std::uint64_t decoders_failed() { return failed_in_all; }

Result<std::unique_ptr<Decoder>> Decoder::start(const Begin& begin, std::string_view brief,
                                                Patience patience) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return failed("socket");
  Descriptor ours(ends[0]), theirs(ends[1]);
  Descriptor shared(::memfd_create("tind-heights", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  Descriptor order(::memfd_create("tind-brief", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (shared.get() < 0 || order.get() < 0) return failed("memory");
  if (::ftruncate(shared.get(), off_t(kSharedBytes)) != 0 ||
      ::fcntl(shared.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    return failed("memory");
  if (write_whole(order.get(), brief) != 0 || ::lseek(order.get(), 0, SEEK_SET) != 0)
    return failed("memory");
  std::unique_ptr<Decoder> decoder(new Decoder);
  void* const memory =
      ::mmap(nullptr, kSharedBytes, PROT_READ | PROT_WRITE, MAP_SHARED, shared.get(), 0);
  if (memory == MAP_FAILED) return failed("memory");
  decoder->memory_ = memory;
  if (!move_up(theirs) || !move_up(shared) || !move_up(order)) return failed("descriptors");
  decoder->socket_ = ours.release();
  const auto process = begin({theirs.get(), shared.get(), order.get()});
  if (!process) return fail(Errc::io, "no process to decode in: " + process.error().what);
  decoder->process_ = *process;
  theirs.close();  // or its end would not be heard
  const auto ready = decoder->hear(0, patience);
  if (!ready) return std::unexpected(ready.error());
  if (ready->status != 0) return fail(Errc::io, decoder->text(*ready));
  return decoder;
}

Decoder::~Decoder() {
  if (socket_ >= 0) ::close(socket_);
  if (process_ > 0) {
    int status = 0;
    ::kill(process_, SIGKILL);
    if (!await(process_, 100ms, status)) Unburied::bury(process_);
  }
  if (memory_) ::munmap(memory_, kSharedBytes);
}

std::chrono::milliseconds Decoder::cpu() const {
  clockid_t clock{};
  timespec time{};
  if (::clock_getcpuclockid(process_, &clock) != 0 || ::clock_gettime(clock, &time) != 0)
    return 0ms;
  return std::chrono::seconds(time.tv_sec) + std::chrono::milliseconds(time.tv_nsec / 1'000'000);
}

void Decoder::turn_bad() {
  if (std::exchange(good_, false)) ++failed_in_all;
}

bool says_crash(const Error& error) {
  constexpr int kCrashes[] = {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGSYS};
  return std::ranges::any_of(kCrashes,
                             [&](int signal) { return error.what.contains(was_ended_by(signal)); });
}

/// It closed its end: what its status says.
Error Decoder::ended() {
  turn_bad();
  int status = 0;
  if (!await(process_, 1000ms, status)) return broken("stopped answering");
  process_ = -1;
  if (WIFSIGNALED(status)) return {Errc::io, was_ended_by(WTERMSIG(status))};
  return {Errc::io, fmt::format("the process that decodes it ended by itself, with exit code {}",
                                WEXITSTATUS(status))};
}

Error Decoder::broken(const char* how) {
  turn_bad();
  return {Errc::io, fmt::format("the process that decodes it {} and was ended", how)};
}

Result<Reply> Decoder::hear(std::uint32_t number, Patience patience) {
  const auto begun = Clock::now();
  const auto cpu_before = cpu();
  for (;;) {
    pollfd ready{socket_, POLLIN, 0};
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(begun + patience.wall - Clock::now());
    const int n = ::poll(&ready, 1, int(std::clamp<std::int64_t>(left.count(), 0, kLook.count())));
    if (n > 0) break;
    if (left <= 0ms) return std::unexpected(broken("took too long"));
    if (cpu() - cpu_before > patience.cpu)
      return std::unexpected(broken("took too much processor time"));
  }
  busy_ += std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begun);
  char packet[sizeof(Reply) + 1];  // one byte more shows a longer one
  ssize_t size;
  while ((size = ::recv(socket_, packet, sizeof packet, 0)) < 0 && errno == EINTR) {
  }
  if (size <= 0) return std::unexpected(ended());
  Reply reply;
  if (size != ssize_t(sizeof reply)) return std::unexpected(broken("answered nonsense"));
  std::memcpy(&reply, packet, sizeof reply);
  const std::size_t most = reply.status == 0 ? kMostText : kMostMessage;
  if (reply.magic != kMagic || reply.number != number || reply.text_bytes > most ||
      reply.status > 1 + std::uint32_t(Errc::internal))
    return std::unexpected(broken("answered nonsense"));
  return reply;
}

Result<Reply> Decoder::ask(Request request, Patience patience) {
  if (!good_) return std::unexpected(broken("failed before"));
  request.number = ++number_;
  ssize_t size;
  // It has read all that came before, or it does not mean to: nobody waits for that.
  while ((size = ::send(socket_, &request, sizeof request, MSG_NOSIGNAL | MSG_DONTWAIT)) < 0 &&
         errno == EINTR) {
  }
  if (size < 0 && errno == EAGAIN) return std::unexpected(broken("does not listen"));
  if (size != ssize_t(sizeof request)) return std::unexpected(ended());
  return hear(request.number, patience);
}

bool Decoder::alive() const {
  pollfd state{socket_, POLLIN, 0};  // nobody asked, so there is nothing to be read
  return good_ && ::poll(&state, 1, 0) == 0;
}

std::string Decoder::text(const Reply& reply) const {
  return {reinterpret_cast<const char*>(shared()), reply.text_bytes};
}

}  // namespace tind::sandbox
