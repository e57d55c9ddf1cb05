#pragma once
// A blocking HTTP client for tests: sends exactly the bytes it is given, and a server in a thread.

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/http/server.h"

namespace tind::test {

struct HttpReply {
  int status = 0;                              // 0: none came
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;
};

/// One connection. Nothing here waits longer than ten seconds.
class HttpClient {
 public:
  /// `from`: an address of this machine, "127.0.0.2". `narrow`: takes little at a time, so that the
  /// server finds its socket full after some ten kilobytes.
  explicit HttpClient(std::uint16_t port, const char* from = nullptr, bool narrow = false);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  /// False when the peer has closed.
  bool send(std::string_view bytes);
  /// One send per byte.
  bool send_slowly(std::string_view bytes);
  void finish_sending();
  /// The next response; `head_only` when it answers a HEAD.
  HttpReply receive(bool head_only = false);
  /// Up to `most` bytes of what comes, kept for receive(); how many.
  std::size_t take(std::size_t most);
  /// True when the peer closes without sending anything more.
  bool closed();

  HttpReply get(const std::string& target, const std::string& fields = "");
  HttpReply head(const std::string& target, const std::string& fields = "");

 private:
  bool fill();
  int fd_ = -1;
  std::string buffer_;
};

/// A server with this router, running in a thread until it goes out of scope.
class RunningServer {
 public:
  RunningServer(const http::Router& router, http::ServerOptions options = {});
  ~RunningServer();
  std::uint16_t port() const { return server_->port(); }
  http::Server& server() { return *server_; }
  /// Stops gracefully; true when every request was answered.
  bool stop();

 private:
  std::unique_ptr<http::Server> server_;
  std::thread thread_;
  bool all_answered_ = false;
};

}  // namespace tind::test
