// A copy's parent is whoever began the nursery (CLONE_PARENT), not the nursery: so it is waited
// for, killed and ended with the daemon as one that the daemon has spawned itself.

#include "terrain/raster/sandbox/nursery.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "terrain/base/errno_text.h"

namespace tind::sandbox {
namespace {

constexpr int kPatienceMs = 5'000;        // it only copies itself
constexpr int kStartPatienceMs = 20'000;  // some two hundred libraries, of a disk that may be cold
constexpr pid_t kReady = 0;               // its first word
constexpr std::size_t kRights = CMSG_SPACE(sizeof(Descriptors));

std::unexpected<Error> failed(const char* what) {
  return fail(Errc::io, std::string("a copy of the program: ") + what + ": " + errno_text(errno));
}

/// One packet of a byte and three descriptors.
struct Packet {
  char byte = 0;
  alignas(cmsghdr) char rights[kRights] = {};
  iovec part{&byte, 1};
  msghdr message{};

  Packet() {
    message.msg_iov = &part, message.msg_iovlen = 1;
    message.msg_control = rights, message.msg_controllen = sizeof rights;
  }
};

/// The next three descriptors; none when nobody will ask any more.
std::optional<Descriptors> receive() {
  for (;;) {
    Packet packet;
    const ssize_t size = ::recvmsg(kSocket, &packet.message, MSG_CMSG_CLOEXEC);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return {};
    const cmsghdr* const rights = CMSG_FIRSTHDR(&packet.message);
    if (!rights || rights->cmsg_len != CMSG_LEN(sizeof(Descriptors))) return {};
    Descriptors descriptors;
    std::memcpy(descriptors.data(), CMSG_DATA(rights), sizeof descriptors);
    return descriptors;
  }
}

/// In the copy: as after spawn(). They came with numbers that may be each other's places.
bool take_places(Descriptors& descriptors) {
  for (int& one : descriptors) {
    one = ::fcntl(one, F_DUPFD, kBrief + 1);
    if (one < 0) return false;
  }
  return ::dup2(descriptors[0], kSocket) >= 0 && ::dup2(descriptors[1], kShared) >= 0 &&
         ::dup2(descriptors[2], kBrief) >= 0 && ::close_range(kBrief + 1, ~0u, 0) == 0;
}

}  // namespace

/// The next number that it says.
Result<pid_t> Nursery::hear(int patience_ms) const {
  pollfd ready{socket_, POLLIN, 0};
  while (::poll(&ready, 1, patience_ms) < 0 && errno == EINTR) {
  }
  pid_t said = -1;
  ssize_t size;
  while ((size = ::recv(socket_, &said, sizeof said, MSG_DONTWAIT)) < 0 && errno == EINTR) {
  }
  if (size != ssize_t(sizeof said)) return failed("no answer");
  return said;
}

Result<void> Nursery::launch() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return failed("socket");
  Descriptor ours(ends[0]), theirs(ends[1]);
  if (!move_up(theirs)) return failed("descriptors");
  const auto process = spawn(command_, {theirs.get(), -1, -1});
  if (!process) return std::unexpected(process.error());
  process_ = *process;
  socket_ = ours.release();
  const auto ready = hear(kStartPatienceMs);
  if (ready && *ready == kReady) return {};
  return std::unexpected(ready ? Error{Errc::io, "a copy of the program: it is none"}
                               : ready.error());
}

void Nursery::end() {
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  if (process_ <= 0) return;
  int status = 0;
  ::kill(process_, SIGKILL);
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
}

Result<pid_t> Nursery::ask(const Descriptors& descriptors) const {
  Packet packet;
  cmsghdr* const rights = CMSG_FIRSTHDR(&packet.message);
  rights->cmsg_level = SOL_SOCKET, rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(sizeof descriptors);
  std::memcpy(CMSG_DATA(rights), descriptors.data(), sizeof descriptors);
  ssize_t size;
  while ((size = ::sendmsg(socket_, &packet.message, MSG_NOSIGNAL)) < 0 && errno == EINTR) {
  }
  if (size != 1) return failed("asking for it");
  const auto process = hear(kPatienceMs);
  if (!process) return process;
  errno = *process < 0 ? -*process : 0;
  if (*process <= 0) return failed("none");
  return process;
}

Result<pid_t> Nursery::begin(const Descriptors& descriptors) {
  if (process_ > 0) {
    if (auto process = ask(descriptors)) return process;
    end();  // somebody has killed it, say
  }
  const auto begun = launch();
  auto process = begun ? ask(descriptors) : std::unexpected(begun.error());
  if (!process) end();  // what it says later would be taken for the answer to another question
  return process;
}

int nurse(const std::function<int()>& decode) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // and if that was too late, the socket is closed
  ::prctl(PR_SET_NAME, "tind-nursery");
  if (::send(kSocket, &kReady, sizeof kReady, MSG_NOSIGNAL) != ssize_t(sizeof kReady)) return 0;
  while (auto descriptors = receive()) {
    // Not fork(): only this has a way to say whose child it is. No other thread holds any lock.
    const auto copy = pid_t(::syscall(SYS_clone, CLONE_PARENT | SIGCHLD, 0, 0, 0, 0));
    if (copy == 0) {
      ::prctl(PR_SET_NAME, "tind-decoder");
      ::_exit(take_places(*descriptors) ? decode() : 1);
    }
    const pid_t answer = copy > 0 ? copy : -errno;
    for (const int one : *descriptors) ::close(one);
    if (::send(kSocket, &answer, sizeof answer, MSG_NOSIGNAL) != ssize_t(sizeof answer)) break;
  }
  return 0;
}

}  // namespace tind::sandbox
