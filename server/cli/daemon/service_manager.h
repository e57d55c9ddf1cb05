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

/// Nothing where none was handed over; an error where it is not one of TCP that listens, or more
/// than one. The environment says so (sd_listen_fds(3)), and says it no more afterwards. Before
/// there are other threads.
Result<std::optional<ListeningSocket>> take_listening_socket();

/// That the daemon serves by now, where it wants to know (sd_notify(3)).
void tell_ready();

}  // namespace tind::cli
