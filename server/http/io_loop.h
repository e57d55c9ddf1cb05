#pragma once
// One core's share of the connections: an io_context that only its own thread runs, with the
// deadlines, the counters and the clock text of its connections. Nothing in here is shared between
// loops, so nothing is locked.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <ctime>
#include <functional>
#include <string>

#include "server/http/admission.h"
#include "server/http/stats.h"
#include "server/http/timer_wheel.h"

namespace tind::http {

class Connection;

/// A place in a ring of connections, which costs no memory of its own. A head has no owner.
struct Link {
  explicit Link(Connection* whose = nullptr) : owner(whose) {}
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link() { leave(); }

  void leave() {
    before->after = after;
    after->before = before;
    before = after = this;
  }
  void enter_last(Link& head) {
    leave();
    before = head.before;
    after = &head;
    before->after = this;
    head.before = this;
  }

  Connection* owner;
  Link* before = this;
  Link* after = this;
};

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

  /// Closes the connection that has waited longest for a request: one that never sent any if
  /// there is one, and one that stopped in the middle of it only if there is no other. False when
  /// nobody just waits. `from`: only of this address, and only looked for among those that have
  /// waited longest.
  bool make_one_give_way(const Address* from);
  /// Makes room for one more of `most` beyond the limit: the oldest that has no request yet goes.
  bool room_for_extra(std::size_t most);

  /// Connections open here. Any thread reads it; only this loop and the acceptor write.
  std::atomic<std::size_t> open{0};
  /// Of these, those that wait for a request or the rest of it. Any thread reads it.
  std::atomic<std::size_t> waiting{0};

  /// Called ten times a second, on this loop's thread. Set before run().
  std::function<void()> on_tick;

  // This loop's thread only.
  Link all;               // the open connections
  Link silent;            // of these, those that have sent nothing yet, the oldest first
  Link kept;              // those that wait for another request, the oldest first
  Link unfinished;        // those that wait for the rest of one, the longest unheard of first
  Link extra;             // those beyond the limit, the oldest first
  bool farewell = false;  // every response is its connection's last
  bool leaving = false;   // and nobody is waited for for long

 private:
  void tick();

  boost::asio::io_context context_{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE_IO};
  boost::asio::steady_timer timer_;
  bool ticking_ = false;
  TimerWheel wheel_;
  Stats stats_;
  std::string date_;
  std::time_t date_of_ = 0;
};

}  // namespace tind::http
