#pragma once
// The daemon's network side: listens, spreads connections over one I/O loop per thread, and
// stops gracefully.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/http/message/limits.h"
#include "server/http/router.h"
#include "server/http/stats.h"
#include "terrain/base/result.h"

namespace tind::http {

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: any free one
  /// The path of a Unix socket instead of both, for its owner alone (mode 0600). One that nobody
  /// listens at any more is replaced; anything else at that path is an error.
  std::string socket = {};
  /// A TCP socket at that address that listens already, in place of binding one; -1: none. Closed
  /// with the server, but whoever handed it over may keep it open: clients that wait at it when the
  /// server stops are left for the one that comes next.
  int listener = -1;
  int threads = 0;  // 0: one per core
  Limits limits;
  std::size_t buffer_bytes = 128 << 20;  // held for clients: request bodies, responses on their way
  bool access_log = false;
  std::vector<std::string> origins = {"*"};  // whose pages may read answers; "*": all
  bool handle_signals = true;                // SIGTERM and SIGINT stop; a second one at once
  /// They do nothing more once the server has gone: for a process that ends with it, and may take a
  /// moment to. Else they then have their default action. (SIGHUP never has.)
  bool signals_to_the_end = false;
  std::function<bool()> hangup_stops = {};   // asked at SIGHUP; where it does not stop:
  std::function<void()> on_hangup = {};      // called on an I/O thread
  std::chrono::milliseconds drain_delay{0};  // not ready, still accepting: for load balancers
  std::chrono::milliseconds grace{10'000};   // for requests in flight
};

class Server {
 public:
  /// Binds and listens. The router must outlive the server, and every responder that a handler
  /// took must be gone before the server is.
  static Result<std::unique_ptr<Server>> listen(const Router&, const ServerOptions&);
  ~Server();

  std::uint16_t port() const;
  /// "http://127.0.0.1:8080/", "unix:/run/tind.sock"
  std::string url() const;

  /// Serves until stop() or a signal, then until the requests in flight are answered (and those
  /// that idle connections send in the next moment) or the grace period is over. True when every
  /// request was answered; false, too, where it stopped because nobody could be accepted any more.
  bool run();

  /// From any thread: stop gracefully.
  void stop();

  /// False from the moment of stop(), and while out of file descriptors.
  bool ready() const;

  StatsSnapshot stats() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl>);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tind::http
