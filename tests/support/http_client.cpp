#include "tests/support/http_client.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

namespace tind::test {

HttpClient::HttpClient(std::uint16_t port, const char* from, bool narrow) {
  fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{60, 0};  // a mesh takes its time under a sanitizer
  const int on = 1;
  ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (narrow) {
    const int buffer = 4096, segment = 536;
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
    ::setsockopt(fd_, IPPROTO_TCP, TCP_MAXSEG, &segment, sizeof segment);
  }
  if (from) {
    sockaddr_in source{};
    source.sin_family = AF_INET;
    ::inet_pton(AF_INET, from, &source.sin_addr);
    if (::bind(fd_, reinterpret_cast<sockaddr*>(&source), sizeof source) != 0)
      throw std::runtime_error("cannot send from that address");
  }
  if (::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("cannot connect to the server under test");
}

HttpClient::~HttpClient() { ::close(fd_); }

bool HttpClient::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(std::size_t(sent));
  }
  return true;
}

bool HttpClient::send_slowly(std::string_view bytes) {
  return std::ranges::all_of(bytes, [&](const char& byte) { return send({&byte, 1}); });
}

void HttpClient::finish_sending() { ::shutdown(fd_, SHUT_WR); }

bool HttpClient::fill() {
  char bytes[16384];
  const ssize_t size = ::recv(fd_, bytes, sizeof bytes, 0);
  if (size > 0) buffer_.append(bytes, std::size_t(size));
  return size > 0;
}

std::size_t HttpClient::take(std::size_t most) {
  std::string bytes(most, '\0');
  std::size_t taken = 0;
  while (taken < most) {
    const ssize_t size = ::recv(fd_, bytes.data() + taken, most - taken, 0);
    if (size <= 0) break;
    taken += std::size_t(size);
  }
  buffer_.append(bytes, 0, taken);
  return taken;
}

bool HttpClient::closed() {
  if (!buffer_.empty()) return false;
  char byte;
  // A reset is a close, too; running into the time limit is not.
  const ssize_t size = ::recv(fd_, &byte, 1, 0);
  return size == 0 || (size < 0 && errno == ECONNRESET);
}

HttpReply HttpClient::receive(bool head_only) {
  HttpReply reply;
  std::size_t end;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos)
    if (!fill()) return reply;
  const std::string head = buffer_.substr(0, end + 2);
  buffer_.erase(0, end + 4);
  std::size_t line = head.find("\r\n") + 2;
  const int status = std::stoi(head.substr(9, 3));
  while (line < head.size()) {
    const std::size_t stop = head.find("\r\n", line), colon = head.find(": ", line);
    std::string name = head.substr(line, colon - line);
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    std::string& value = reply.headers[name];  // lines of one name are a list [RFC 9110, 5.3]
    value += (value.empty() ? "" : ", ") + head.substr(colon + 2, stop - colon - 2);
    line = stop + 2;
  }
  std::size_t size = 0;
  if (!head_only && reply.headers.contains("content-length"))
    size = std::stoul(reply.headers["content-length"]);
  while (buffer_.size() < size)
    if (!fill()) return {};
  reply.body = buffer_.substr(0, size);
  buffer_.erase(0, size);
  reply.status = status;
  return reply;
}

HttpReply HttpClient::get(const std::string& target, const std::string& fields) {
  if (!send("GET " + target + " HTTP/1.1\r\nHost: test\r\n" + fields + "\r\n")) return {};
  return receive();
}

HttpReply HttpClient::head(const std::string& target, const std::string& fields) {
  if (!send("HEAD " + target + " HTTP/1.1\r\nHost: test\r\n" + fields + "\r\n")) return {};
  return receive(true);
}

RunningServer::RunningServer(const http::Router& router, http::ServerOptions options) {
  options.port = 0;
  options.handle_signals = false;
  if (options.threads == 0) options.threads = 2;
  auto listening = http::Server::listen(router, options);
  if (!listening) throw std::runtime_error(listening.error().what);
  server_ = std::move(*listening);
  thread_ = std::thread([this] { all_answered_ = server_->run(); });
}

bool RunningServer::stop() {
  if (thread_.joinable()) {
    server_->stop();
    thread_.join();
  }
  return all_answered_;
}

RunningServer::~RunningServer() { stop(); }

}  // namespace tind::test
