#pragma once
// One core's share of the connections: an io_context that only its own thread runs, with the
// deadlines, the counters and the clock text of its connections. Nothing in here is shared between
// loops, so nothing is locked.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <ctime>
#include <string>

#include "server/http/stats.h"
#include "server/http/timer_wheel.h"

namespace tind::http {

class Connection;

class IoLoop {
 public:
  IoLoop() : timer_(context_), wheel_(TimerWheel::Clock::now()) {}

  /// Until stop(); what is posted meanwhile runs here.
  void run();
  void stop() { context_.stop(); }

  boost::asio::io_context& context() { return context_; }
  Stats& stats() { return stats_; }
  const Stats& stats() const { return stats_; }

  void set_deadline(TimerWheel::Timer& timer, std::chrono::milliseconds after) {
    wheel_.set(timer, TimerWheel::Clock::now(), after);
  }
  /// "Date: Sat, 21 Nov 2026 09:00:00 GMT\r\n", of this second.
  const std::string& date_line();

  /// Connections open here. Any thread reads it; only this loop and the acceptor write.
  std::atomic<std::size_t> open{0};

  // The open connections, for draining: an intrusive list, this loop's thread only.
  Connection* first = nullptr;
  bool draining = false;

 private:
  void tick();

  boost::asio::io_context context_{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE_IO};
  boost::asio::steady_timer timer_;
  TimerWheel wheel_;
  Stats stats_;
  std::string date_;
  std::time_t date_of_ = 0;
};

}  // namespace tind::http
