// Both protocols are environment variables and a datagram, which systemd promises to keep as they
// are: no reason to load its library, and what that loads, into a daemon.

#include "server/cli/daemon/service_manager.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "terrain/base/descriptor.h"

namespace tind::cli {
namespace {

constexpr int kFirst = 3;  // SD_LISTEN_FDS_START

std::string take_variable(const char* name) {
  // NOLINTBEGIN(concurrency-mt-unsafe): there are no other threads yet
  const char* const value = std::getenv(name);
  std::string taken = value ? value : "";
  ::unsetenv(name);
  // NOLINTEND(concurrency-mt-unsafe)
  return taken;
}

int option_of(int socket, int option) {
  int value = 0;
  socklen_t size = sizeof value;
  return ::getsockopt(socket, SOL_SOCKET, option, &value, &size) == 0 ? value : -1;
}

/// Empty where it is none of the internet.
std::string address_of(int socket) {
  sockaddr_storage at{};
  socklen_t size = sizeof at;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (at.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(at);
    ::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return fmt::format("{}:{}", text.data(), ntohs(v4.sin_port));
  }
  if (at.ss_family != AF_INET6) return {};
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(at);
  ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  return fmt::format("[{}]:{}", text.data(), ntohs(v6.sin6_port));
}

}  // namespace

Result<std::optional<ListeningSocket>> take_listening_socket() {
  const std::string process = take_variable("LISTEN_PID"), count = take_variable("LISTEN_FDS");
  take_variable("LISTEN_FDNAMES");
  // Variables that somebody further up left are not for this process.
  if (process != std::to_string(::getpid()) || count.empty() || count == "0") return std::nullopt;
  if (count != "1")
    return fail(Errc::invalid_argument,
                fmt::format("was handed {} sockets to listen at, and takes one: one ListenStream= "
                            "in its socket unit",
                            count));
  const std::string address = address_of(kFirst);
  if (address.empty() || option_of(kFirst, SO_TYPE) != SOCK_STREAM ||
      option_of(kFirst, SO_ACCEPTCONN) != 1)
    return fail(Errc::invalid_argument,
                "the socket that was handed over is none of TCP that listens: ListenStream= names "
                "a port, with Accept=no");
  ::fcntl(kFirst, F_SETFD, FD_CLOEXEC);  // not for those who decode, nor for jobs
  return ListeningSocket{kFirst, address};
}

void tell_ready() {
  constexpr std::string_view kReady = "READY=1";
  const char* const value = std::getenv("NOTIFY_SOCKET");  // NOLINT(concurrency-mt-unsafe)
  const std::string path = value ? value : "";
  sockaddr_un address{};
  if (path.size() < 2 || path.size() >= sizeof address.sun_path) return;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  if (path[0] == '@') address.sun_path[0] = '\0';
  const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  // Who cannot be told does without: a daemon that serves is no failure.
  [[maybe_unused]] const ssize_t sent =
      ::sendto(socket.get(), kReady.data(), kReady.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
               reinterpret_cast<const sockaddr*>(&address),
               socklen_t(offsetof(sockaddr_un, sun_path) + path.size()));
}

}  // namespace tind::cli
