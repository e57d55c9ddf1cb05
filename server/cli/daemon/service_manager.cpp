// Both protocols are environment variables and a datagram, which systemd promises to keep as they
// are: no reason to load its library, and what that loads, into a daemon.

#include "server/cli/daemon/service_manager.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"

namespace tind::cli {
namespace {

constexpr int kFirst = 3;           // SD_LISTEN_FDS_START
constexpr timeval kPatience{5, 0};  // its queue may be full

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

Result<std::optional<ListeningSocket>> take_listening_socket() {
  const std::string process = take_variable("LISTEN_PID"), count = take_variable("LISTEN_FDS");
  take_variable("LISTEN_FDNAMES");
  // Variables that somebody further up left are not for this process.
  if (process != std::to_string(::getpid()) || count.empty() || count == "0") return std::nullopt;
  if (count != "1")
    return fail(Errc::invalid_argument,
                fmt::format("LISTEN_FDS is {}: the daemon takes one socket to listen at, one "
                            "ListenStream= in its socket unit",
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

}  // namespace

Result<ServiceManager> take_service_manager() {
  ServiceManager manager;
  manager.notify = take_variable("NOTIFY_SOCKET");
  auto socket = take_listening_socket();
  if (!socket) return std::unexpected(socket.error());
  manager.socket = std::move(*socket);
  return manager;
}

Result<void> tell_ready(const ServiceManager& manager) {
  const std::string& path = manager.notify;
  if (path.empty()) return {};
  constexpr std::string_view kReady = "READY=1";
  const auto cannot = [&](const std::string& why) {
    return fail(Errc::io,
                "NOTIFY_SOCKET, " + path + ", cannot be told that the daemon serves: " + why);
  };
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const bool is_abstract = path[0] == '@';  // needs no 0 at its end
  if (path.size() + (is_abstract ? 0 : 1) > sizeof address.sun_path)
    return cannot(errno_text(ENAMETOOLONG));
  std::memcpy(address.sun_path, path.data(), path.size());
  if (is_abstract) address.sun_path[0] = '\0';
  const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  if (::sendto(socket.get(), kReady.data(), kReady.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address),
               socklen_t(offsetof(sockaddr_un, sun_path) + path.size())) < 0)
    return cannot(errno_text(errno));
  return {};
}

}  // namespace tind::cli
