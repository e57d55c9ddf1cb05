#include "server/http/server.h"

#include <fcntl.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <csignal>
#include <initializer_list>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "server/http/connection.h"
#include "server/http/io_loop.h"
#include "server/http/message/problem.h"
#include "server/http/unix_socket.h"
#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/parallel.h"

// One acceptor, on the first loop, hands each connection to the loop that has fewest: steadier for
// a few threads than SO_REUSEPORT, whose hash spreads unevenly.
//
// When there are as many as may be (in all, or from that address), one that only waits for a
// request, or has stopped in the middle of one, gives way: connections that are held open for
// nothing then keep nobody out. Each loop knows its own, so they are asked one after the other.
// Where all are busy, a few more are let in and told so; what watches the server is answered
// even then.
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

/// Sent where there is no room even to say it; the socket is closed whether or not it can take it.
constexpr std::string_view kFull =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nRetry-After: 1\r\n"
    "Connection: close\r\n\r\n";

constexpr const char* kTooMany = "too_many_connections";
constexpr const char* kTooManyFromOne = "too_many_from_one_address";

/// Without a set that stays, Asio puts the default action back when the server goes: a signal just
/// then would end who is ending by himself, with another code. Reached until the end: no leak.
void keep_handled(std::initializer_list<int> signals) {
  static asio::io_context* const context = new asio::io_context;
  static asio::signal_set* const set = new asio::signal_set(*context);
  for (const int signal : signals) set->add(signal);  // once, however often
}

}  // namespace

struct Server::Impl {
  Impl(const Router& router, const ServerOptions& given)
      : options(given),
        memory(options.buffer_bytes),
        context{router,
                options.limits,
                memory,
                options.access_log,
                std::ranges::find(options.origins, "*") != options.origins.end(),
                options.origins} {}

  // start
  Result<void> open();
  Result<void> listen_at_port();
  error_code take_or_bind(const tcp::endpoint& endpoint);
  Result<void> listen_at_socket();

  // accepting, on the first loop
  void wait_for_clients();
  void accept_clients();
  bool accept_one();
  void hand_over(Descriptor fd, const Address& from);
  void send_to(std::size_t loop, Descriptor fd, const Address& from, const char* crowded,
               std::size_t others);
  void take_in(std::size_t loop, Descriptor fd, Slot slot, const char* crowded, std::size_t others);
  void tend();
  void out_of_descriptors(int error);
  void listener_has_failed(int error);
  std::size_t open_connections() const;

  // stopping, on the first loop
  void wait_for_signal();
  void begin_drain();
  void close_listener();
  void wait_until_drained(std::chrono::steady_clock::time_point until);

  ServerOptions options;
  ByteBudget memory;
  Addresses addresses;
  ConnectionContext context;
  std::vector<std::unique_ptr<IoLoop>> loops;
  std::optional<UnixSocket> unix_socket;  // its file goes with this
  std::unique_ptr<tcp::acceptor> acceptor;
  std::unique_ptr<asio::steady_timer> drain_timer;
  std::unique_ptr<asio::signal_set> signals;
  tcp protocol = tcp::v4();
  std::uint16_t bound_port = 0;  // asked once: the acceptor is the first loop's alone
  int reserve_fd = -1;
  bool waiting_for_clients = false, listener_failed = false;
  std::chrono::steady_clock::time_point last_complaint{};
  std::atomic<bool> stopping{false}, starved{false};
  bool all_answered = true;
};

Result<void> Server::Impl::open() {
  const int threads = options.threads > 0 ? options.threads : hardware_threads();
  for (int i = 0; i < threads; ++i) loops.push_back(std::make_unique<IoLoop>());
  acceptor = std::make_unique<tcp::acceptor>(loops[0]->context());
  if (auto done = options.socket.empty() ? listen_at_port() : listen_at_socket(); !done)
    return done;
  drain_timer = std::make_unique<asio::steady_timer>(loops[0]->context());
  reserve_fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (options.handle_signals) {
    keep_handled({SIGHUP});
    signals = std::make_unique<asio::signal_set>(loops[0]->context(), SIGTERM, SIGINT, SIGHUP);
  }
  return {};
}

Result<void> Server::Impl::listen_at_port() {
  const std::string where = options.address + ":" + std::to_string(options.port);
  const auto cannot = [&](const error_code& error) {
    return fail(Errc::io, "cannot listen on " + where + ": " + error.message());
  };
  error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error)
    return fail(Errc::invalid_argument, options.address + " is not an IP address to listen on");
  if (error = take_or_bind({address, options.port}); error) return cannot(error);
  if (acceptor->non_blocking(true, error)) return cannot(error);
  bound_port = acceptor->local_endpoint(error).port();
  if (error) return cannot(error);
  return {};
}

error_code Server::Impl::take_or_bind(const tcp::endpoint& endpoint) {
  error_code error;
  protocol = endpoint.protocol();
  if (options.listener >= 0) {
    // Any holder of it may take away that calls of it do not wait, as systemd does when it begins
    // another daemon.
    const timeval soon{0, 1000};
    ::setsockopt(options.listener, SOL_SOCKET, SO_RCVTIMEO, &soon, sizeof soon);
    return acceptor->assign(protocol, options.listener, error);
  }
  if (acceptor->open(protocol, error)) return error;
  if (acceptor->set_option(tcp::acceptor::reuse_address(true), error)) return error;
  if (acceptor->bind(endpoint, error)) return error;
  return acceptor->listen(kBacklog, error);
}

/// Asio's sockets only carry the descriptor: what is TCP's own (an address, TCP_NODELAY) fails
/// without harm.
Result<void> Server::Impl::listen_at_socket() {
  auto bound = UnixSocket::listen(options.socket, kBacklog);
  if (!bound) return std::unexpected(bound.error());
  unix_socket.emplace(std::move(*bound));
  error_code error;
  if (acceptor->assign(protocol, unix_socket->take_descriptor(), error))
    return fail(Errc::io, "cannot listen at " + options.socket + ": " + error.message());
  return {};
}

// --- accepting -----------------------------------------------------------------------------------

void Server::Impl::wait_for_clients() {
  if (!acceptor->is_open() || waiting_for_clients || listener_failed) return;
  acceptor->async_wait(tcp::acceptor::wait_read, [this](const error_code& error) {
    waiting_for_clients = false;
    if (!error) accept_clients();
  });
  waiting_for_clients = true;
}

void Server::Impl::accept_clients() {
  for (int i = 0; i < kAcceptsAtOnce; ++i)
    if (!accept_one()) break;
  if (!starved) wait_for_clients();
}

/// Ten times a second. Accepting goes on here after a pause for want of descriptors, and when an
/// exception (no memory) has ended it.
void Server::Impl::tend() {
  if (starved && reserve_fd < 0) reserve_fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  starved = starved && reserve_fd < 0;
  if (!starved) wait_for_clients();
}

/// False when there is nobody, or no descriptor for anybody.
bool Server::Impl::accept_one() {
  if (!acceptor->is_open()) return false;
  sockaddr_storage from{};
  socklen_t size = sizeof from;
  Descriptor fd(::accept4(acceptor->native_handle(), reinterpret_cast<sockaddr*>(&from), &size,
                          SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (fd.get() >= 0) {
    hand_over(std::move(fd), address_of(from));
    return true;
  }
  if (errno == EINVAL || errno == EBADF || errno == ENOTSOCK || errno == EOPNOTSUPP) {
    listener_has_failed(errno);
    return false;
  }
  const bool exhausted = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
  if (exhausted) out_of_descriptors(errno);
  // Other errors are of one client that has gone already (ECONNABORTED, EPROTO, ...).
  return !exhausted && errno != EAGAIN && errno != EWOULDBLOCK;
}

/// Whoever has it, too, has shut it down, say: nobody comes any more.
void Server::Impl::listener_has_failed(int error) {
  if (std::exchange(listener_failed, true) || stopping) return;
  spdlog::error("nobody can be accepted any more: {}; stopping", errno_text(error));
  begin_drain();
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
  spdlog::warn("cannot accept: {}; {} connections are open", errno_text(error), open_connections());
}

std::size_t Server::Impl::open_connections() const {
  std::size_t sum = 0;
  for (const auto& loop : loops) sum += loop->open.load(std::memory_order_relaxed);
  return sum;
}

void Server::Impl::hand_over(Descriptor fd, const Address& from) {
  const int on = 1;
  ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const char* crowded = nullptr;
  if (open_connections() >= options.limits.connections) crowded = kTooMany;
  if (addresses.count(from) >= options.limits.per_address) crowded = kTooManyFromOne;
  std::size_t best = 0;
  const auto count = [&](std::size_t i) {
    return (crowded ? loops[i]->waiting : loops[i]->open).load(std::memory_order_relaxed);
  };
  for (std::size_t i = 1; i < loops.size(); ++i)
    if (crowded ? count(i) > count(best) : count(i) < count(best)) best = i;
  loops[0]->stats().count_accepted();
  send_to(best, std::move(fd), from, crowded, loops.size() - 1);
}

/// `others`: how many loops may be asked after this one whether somebody gives way.
void Server::Impl::send_to(std::size_t loop, Descriptor fd, const Address& from,
                           const char* crowded, std::size_t others) {
  asio::post(loops[loop]->context(), [this, loop, crowded, others, fd = std::move(fd),
                                      slot = Slot(addresses, from, loops[loop]->open)]() mutable {
    take_in(loop, std::move(fd), std::move(slot), crowded, others);
  });
}

/// On the connection's own loop. `crowded`: somebody must go for this one to be served.
void Server::Impl::take_in(std::size_t index, Descriptor fd, Slot slot, const char* crowded,
                           std::size_t others) {
  IoLoop& loop = *loops[index];
  if (crowded) {
    if (loop.make_one_give_way(crowded == kTooManyFromOne ? &slot.address() : nullptr)) {
      loop.stats().count_rejected("gave_way");
      crowded = nullptr;
    } else if (others > 0) {
      const Address from = slot.address();
      slot.give_back();
      return send_to((index + 1) % loops.size(), std::move(fd), from, crowded, others - 1);
    }
  }
  if (crowded && !loop.room_for_extra(options.limits.extra)) {
    loop.stats().count_rejected(crowded);
    [[maybe_unused]] const ssize_t sent =
        ::send(fd.get(), kFull.data(), kFull.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return;
  }
  tcp::socket socket(loop.context());
  error_code error;
  if (socket.assign(protocol, fd.get(), error)) return;
  fd.release();
  if (socket.non_blocking(true, error)) return;
  std::make_shared<Connection>(loop, context, std::move(socket), std::move(slot), crowded)->start();
}

// --- stopping ------------------------------------------------------------------------------------

void Server::Impl::wait_for_signal() {
  if (!signals) return;
  signals->async_wait([this](const error_code& error, int number) {
    if (error) return;
    wait_for_signal();
    if (number == SIGHUP && (stopping || !options.hangup_stops || !options.hangup_stops())) {
      if (!stopping && options.on_hangup) options.on_hangup();
      return;
    }
    if (stopping) {
      spdlog::warn("signal {} again: stopping at once", number);
      all_answered = false;
      for (const auto& loop : loops) loop->stop();
      return;
    }
    spdlog::info("signal {}: finishing what is in flight", number);
    begin_drain();
  });
}

/// From now on every response is its connection's last. A connection that is idle is not closed: a
/// request may be on its way. Once the port is closed it has a moment for that.
void Server::Impl::begin_drain() {
  if (stopping.exchange(true)) return;
  for (const auto& loop : loops)
    asio::post(loop->context(), [loop = loop.get()] { loop->farewell = true; });
  drain_timer->expires_after(options.drain_delay);
  drain_timer->async_wait([this](const error_code&) {
    close_listener();
    for (const auto& loop : loops)
      asio::post(loop->context(), [loop = loop.get()] {
        loop->leaving = true;
        for (Link* link = loop->all.after; link != &loop->all;) {
          Connection& connection = *link->owner;
          link = link->after;
          connection.leave();
        }
      });
    wait_until_drained(std::chrono::steady_clock::now() + options.grace);
  });
}

void Server::Impl::close_listener() {
  // Clients that the kernel has already accepted for us would otherwise be reset: unless somebody
  // keeps the socket, where they wait.
  if (options.listener < 0)
    for (int i = 0; i < kBacklog && accept_one(); ++i) {
    }
  error_code ignored;
  (void)acceptor->close(ignored);
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
  if (!impl_->options.socket.empty()) return "unix:" + impl_->options.socket;
  const bool v6 = impl_->options.address.find(':') != std::string::npos;
  const std::string host = v6 ? "[" + impl_->options.address + "]" : impl_->options.address;
  return "http://" + host + ":" + std::to_string(port()) + "/";
}

bool Server::run() {
  // Not before: a start that fails can be ended by a signal to its end.
  if (impl_->options.handle_signals && impl_->options.signals_to_the_end)
    keep_handled({SIGTERM, SIGINT});
  impl_->wait_for_signal();
  impl_->loops[0]->on_tick = [impl = impl_.get()] { impl->tend(); };
  impl_->wait_for_clients();
  std::vector<std::jthread> threads;  // where one cannot be begun, those before it end
  for (std::size_t i = 1; i < impl_->loops.size(); ++i)
    threads.emplace_back([loop = impl_->loops[i].get()](const std::stop_token& stop) {
      const std::stop_callback at_end(stop, [loop] { loop->stop(); });
      loop->run();
    });
  impl_->loops[0]->run();
  for (std::jthread& thread : threads) thread.join();
  return impl_->all_answered && !impl_->listener_failed;
}

void Server::stop() {
  boost::asio::post(impl_->loops[0]->context(), [impl = impl_.get()] { impl->begin_drain(); });
}

bool Server::ready() const { return !impl_->stopping && !impl_->starved; }

StatsSnapshot Server::stats() const {
  StatsSnapshot sum;
  sum.held_bytes = impl_->memory.held();
  sum.held_limit = impl_->memory.limit();
  for (const auto& loop : impl_->loops) {
    loop->stats().add_to(sum);
    sum.connections += loop->open.load(std::memory_order_relaxed);
  }
  return sum;
}

}  // namespace tind::http
