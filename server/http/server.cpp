#include "server/http/server.h"

#include <fcntl.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <thread>
#include <vector>

#include "server/http/connection.h"
#include "server/http/io_loop.h"
#include "server/http/problem.h"
#include "terrain/base/parallel.h"

// One acceptor, on the first loop, hands each connection to the loop that has fewest: steadier for
// a few threads than SO_REUSEPORT, whose hash spreads unevenly.
//
// Running out of file descriptors must not turn the acceptor into a busy loop (the connection that
// cannot be accepted stays pending, so "readable" fires at once again): a descriptor is kept in
// reserve, given up to accept and close one client with a clear sign, and then we pause.

namespace tind::http {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr int kBacklog = 4096;
constexpr int kAcceptsAtOnce = 64;
constexpr std::chrono::milliseconds kDrainPoll{20};

/// Sent to a client over the limit; the socket is closed whether or not it can take it.
constexpr std::string_view kFull =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nRetry-After: 1\r\n"
    "Connection: close\r\n\r\n";

}  // namespace

struct Server::Impl {
  Impl(const Router& router, const ServerOptions& given)
      : options(given), context{router, options.limits, options.access_log} {}

  // start
  Result<void> open();

  // accepting, on the first loop
  void wait_for_clients();
  void accept_clients();
  bool accept_one();
  void hand_over(int fd);
  void out_of_descriptors(int error);
  std::size_t open_connections() const;

  // stopping, on the first loop
  void wait_for_signal();
  void begin_drain();
  void close_listener();
  void wait_until_drained(std::chrono::steady_clock::time_point until);

  ServerOptions options;
  ConnectionContext context;
  std::vector<std::unique_ptr<IoLoop>> loops;
  std::unique_ptr<tcp::acceptor> acceptor;
  std::unique_ptr<asio::steady_timer> accept_timer, drain_timer;
  std::unique_ptr<asio::signal_set> signals;
  tcp protocol = tcp::v4();
  std::uint16_t bound_port = 0;  // asked once: the acceptor is the first loop's alone
  int reserve_fd = -1;
  std::chrono::steady_clock::time_point last_complaint{};
  std::atomic<bool> stopping{false}, starved{false};
  bool all_answered = true;
};

Result<void> Server::Impl::open() {
  const std::string where = options.address + ":" + std::to_string(options.port);
  const auto cannot = [&](const error_code& error) {
    return fail(Errc::io, "cannot listen on " + where + ": " + error.message());
  };
  const int threads = options.threads > 0 ? options.threads : hardware_threads();
  for (int i = 0; i < threads; ++i) loops.push_back(std::make_unique<IoLoop>());
  error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error)
    return fail(Errc::invalid_argument, options.address + " is not an IP address to listen on");
  const tcp::endpoint endpoint(address, options.port);
  protocol = endpoint.protocol();
  acceptor = std::make_unique<tcp::acceptor>(loops[0]->context());
  if (acceptor->open(protocol, error)) return cannot(error);
  if (acceptor->set_option(tcp::acceptor::reuse_address(true), error)) return cannot(error);
  if (acceptor->bind(endpoint, error)) return cannot(error);
  if (acceptor->listen(kBacklog, error)) return cannot(error);
  if (acceptor->non_blocking(true, error)) return cannot(error);
  bound_port = acceptor->local_endpoint(error).port();
  if (error) return cannot(error);
  accept_timer = std::make_unique<asio::steady_timer>(loops[0]->context());
  drain_timer = std::make_unique<asio::steady_timer>(loops[0]->context());
  reserve_fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (options.handle_signals)
    signals = std::make_unique<asio::signal_set>(loops[0]->context(), SIGTERM, SIGINT);
  return {};
}

// --- accepting -----------------------------------------------------------------------------------

void Server::Impl::wait_for_clients() {
  if (!acceptor->is_open()) return;
  acceptor->async_wait(tcp::acceptor::wait_read, [this](const error_code& error) {
    if (!error) accept_clients();
  });
}

void Server::Impl::accept_clients() {
  for (int i = 0; i < kAcceptsAtOnce; ++i)
    if (!accept_one()) break;
  if (!starved) return wait_for_clients();
  accept_timer->expires_after(options.limits.accept_backoff);
  accept_timer->async_wait([this](const error_code& error) {
    if (error) return;
    if (reserve_fd < 0) reserve_fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    starved = reserve_fd < 0;
    accept_clients();
  });
}

/// False when there is nobody, or no descriptor for anybody.
bool Server::Impl::accept_one() {
  if (!acceptor->is_open()) return false;
  const int fd =
      ::accept4(acceptor->native_handle(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd >= 0) {
    if (open_connections() >= options.limits.connections) {
      loops[0]->stats().count_rejected("too_many_connections");
      [[maybe_unused]] const ssize_t sent =
          ::send(fd, kFull.data(), kFull.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      ::close(fd);
    } else {
      hand_over(fd);
    }
    return true;
  }
  const bool exhausted = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
  if (exhausted) out_of_descriptors(errno);
  // Other errors are of one client that has gone already (ECONNABORTED, EPROTO, ...).
  return !exhausted && errno != EAGAIN && errno != EWOULDBLOCK;
}

void Server::Impl::out_of_descriptors(int error) {
  starved = true;
  loops[0]->stats().count_rejected("out_of_descriptors");
  if (reserve_fd >= 0) {
    ::close(reserve_fd);
    const int fd = ::accept4(acceptor->native_handle(), nullptr, nullptr, SOCK_CLOEXEC);
    if (fd >= 0) ::close(fd);
    reserve_fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  }
  const auto now = std::chrono::steady_clock::now();
  if (now - last_complaint < std::chrono::seconds(1)) return;
  last_complaint = now;
  spdlog::warn("cannot accept: {}; {} connections are open", std::strerror(error),
               open_connections());
}

std::size_t Server::Impl::open_connections() const {
  std::size_t sum = 0;
  for (const auto& loop : loops) sum += loop->open.load(std::memory_order_relaxed);
  return sum;
}

void Server::Impl::hand_over(int fd) {
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  IoLoop* fewest = loops[0].get();
  for (const auto& loop : loops)
    if (loop->open.load(std::memory_order_relaxed) < fewest->open.load(std::memory_order_relaxed))
      fewest = loop.get();
  fewest->open.fetch_add(1, std::memory_order_relaxed);
  loops[0]->stats().count_accepted();
  asio::post(fewest->context(), [this, fewest, fd] {
    tcp::socket socket(fewest->context());
    error_code error;
    if (socket.assign(protocol, fd, error)) {
      ::close(fd);
      fewest->open.fetch_sub(1, std::memory_order_relaxed);
      return;
    }
    socket.non_blocking(true, error);
    std::make_shared<Connection>(*fewest, context, std::move(socket))->start();
  });
}

// --- stopping ------------------------------------------------------------------------------------

void Server::Impl::wait_for_signal() {
  if (!signals) return;
  signals->async_wait([this](const error_code& error, int number) {
    if (error) return;
    if (stopping) {
      spdlog::warn("signal {} again: stopping at once", number);
      all_answered = false;
      for (const auto& loop : loops) loop->stop();
      return;
    }
    spdlog::info("signal {}: finishing what is in flight", number);
    begin_drain();
    wait_for_signal();
  });
}

void Server::Impl::begin_drain() {
  if (stopping.exchange(true)) return;
  drain_timer->expires_after(options.drain_delay);
  drain_timer->async_wait([this](const error_code&) {
    close_listener();
    for (const auto& loop : loops)
      asio::post(loop->context(), [loop = loop.get()] {
        loop->draining = true;
        for (Connection* connection = loop->first; connection;) {
          Connection* const next = connection->next;
          connection->drain();
          connection = next;
        }
      });
    wait_until_drained(std::chrono::steady_clock::now() + options.grace);
  });
}

void Server::Impl::close_listener() {
  // Clients that the kernel has already accepted for us would otherwise be reset.
  for (int i = 0; i < kBacklog && accept_one(); ++i) {
  }
  error_code ignored;
  acceptor->close(ignored);
  accept_timer->cancel();
}

void Server::Impl::wait_until_drained(std::chrono::steady_clock::time_point until) {
  all_answered = open_connections() == 0;
  if (all_answered || std::chrono::steady_clock::now() >= until) {
    if (!all_answered)
      spdlog::warn("{} connections were still open after the grace period", open_connections());
    for (const auto& loop : loops) loop->stop();
    return;
  }
  drain_timer->expires_after(kDrainPoll);
  drain_timer->async_wait([this, until](const error_code&) { wait_until_drained(until); });
}

// --- the public face -----------------------------------------------------------------------------

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() {
  if (impl_->reserve_fd >= 0) ::close(impl_->reserve_fd);
}

Result<std::unique_ptr<Server>> Server::listen(const Router& router, const ServerOptions& options) {
  auto impl = std::make_unique<Impl>(router, options);
  if (auto opened = impl->open(); !opened) return std::unexpected(opened.error());
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

std::uint16_t Server::port() const { return impl_->bound_port; }

std::string Server::url() const {
  const bool v6 = impl_->options.address.find(':') != std::string::npos;
  const std::string host = v6 ? "[" + impl_->options.address + "]" : impl_->options.address;
  return "http://" + host + ":" + std::to_string(port()) + "/";
}

bool Server::run() {
  impl_->wait_for_signal();
  impl_->wait_for_clients();
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < impl_->loops.size(); ++i)
    threads.emplace_back([loop = impl_->loops[i].get()] { loop->run(); });
  impl_->loops[0]->run();
  for (std::thread& thread : threads) thread.join();
  return impl_->all_answered;
}

void Server::stop() {
  boost::asio::post(impl_->loops[0]->context(), [impl = impl_.get()] { impl->begin_drain(); });
}

bool Server::ready() const { return !impl_->stopping && !impl_->starved; }

StatsSnapshot Server::stats() const {
  StatsSnapshot sum;
  for (const auto& loop : impl_->loops) {
    loop->stats().add_to(sum);
    sum.connections += loop->open.load(std::memory_order_relaxed);
  }
  return sum;
}

}  // namespace tind::http
