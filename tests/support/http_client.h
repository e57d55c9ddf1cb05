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
  explicit HttpClient(std::uint16_t port);
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
