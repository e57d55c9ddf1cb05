#include "server/http/io_loop.h"

#include <spdlog/spdlog.h>

#include <boost/asio/executor_work_guard.hpp>
#include <exception>

#include "server/http/connection.h"

// Whatever throws in a loop (memory that is not there) costs at most the connection it was about:
// the clock, on which all deadlines depend, is started anew, and what the clock calls may throw.

namespace tind::http {
namespace {

constexpr int kLookedAt = 1024;  // of one address among the rest: must not cost the loop its time

}  // namespace

void IoLoop::tick() {
  timer_.expires_after(TimerWheel::kTick);
  timer_.async_wait([this](const boost::system::error_code& error) {
    ticking_ = false;
    if (error) return;
    wheel_.advance(TimerWheel::Clock::now());
    if (on_tick) on_tick();
    tick();
  });
  ticking_ = true;
}

void IoLoop::run() {
  const auto work = boost::asio::make_work_guard(context_);
  while (!context_.stopped()) {
    try {
      if (!ticking_) tick();
      context_.run();
    } catch (const std::exception& error) {
      spdlog::error("in an I/O thread: {}", error.what());
    }
  }
}

bool IoLoop::make_one_give_way(const Address* from) {
  for (Link* const ring : {&silent, &kept, &unfinished}) {
    int looked = 0;
    for (Link* link = ring->after; link != ring && looked < kLookedAt; ++looked) {
      Connection& connection = *link->owner;
      link = link->after;
      if (from && connection.address() != *from) continue;
      if (connection.give_way()) return true;
    }
  }
  return false;
}

bool IoLoop::room_for_extra(std::size_t most) {
  std::size_t count = 0;
  for (const Link* link = extra.after; link != &extra; link = link->after) ++count;
  for (Link* link = extra.after; link != &extra && count >= most;) {
    Connection& connection = *link->owner;
    link = link->after;
    if (connection.give_up()) --count;
  }
  return count < most;
}

const std::string& IoLoop::date_line() {
  const std::time_t now = std::time(nullptr);
  if (now != date_of_) {
    std::tm parts{};
    gmtime_r(&now, &parts);
    char text[64];
    const std::size_t size =
        std::strftime(text, sizeof text, "Date: %a, %d %b %Y %H:%M:%S GMT\r\n", &parts);
    date_.assign(text, size);
    date_of_ = now;
  }
  return date_;
}

}  // namespace tind::http
