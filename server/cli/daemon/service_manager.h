#pragma once
// What the program that starts a daemon, as systemd does, hands over to it, and what it wants to
// hear of it.

#include <optional>
#include <string>

#include "terrain/base/result.h"

namespace tind::cli {

/// A TCP socket of whoever started the daemon, who listens at it already. It stays his: clients
/// that come while no daemon runs wait there for the next one.
struct ListeningSocket {
  int descriptor = -1;
  std::string address;  // "127.0.0.1:8080", "[::1]:8080"
};

struct ServiceManager {
  std::optional<ListeningSocket> socket;  // nothing where none was handed over
  std::string notify;                     // where it wants to hear; empty: nowhere
};

/// As the environment says (sd_listen_fds(3), sd_notify(3)), which says it no more afterwards: it
/// is not for children. An error where there is more than one socket, or one that is none of TCP
/// that listens. Before there are other threads.
Result<ServiceManager> take_service_manager();

/// That the daemon serves by now, where it wants to hear that. Waits some seconds at most; the
/// error says why it could not be told.
Result<void> tell_ready(const ServiceManager&);

}  // namespace tind::cli
