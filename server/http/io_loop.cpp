#include "server/http/io_loop.h"

#include <spdlog/spdlog.h>

#include <boost/asio/executor_work_guard.hpp>
#include <exception>

namespace tind::http {

void IoLoop::tick() {
  timer_.expires_after(TimerWheel::kTick);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    wheel_.advance(TimerWheel::Clock::now());
    tick();
  });
}

void IoLoop::run() {
  const auto work = boost::asio::make_work_guard(context_);
  tick();
  while (!context_.stopped()) {
    try {
      context_.run();
    } catch (const std::exception& error) {  // costs the one connection whose handler threw
      spdlog::error("in an I/O thread: {}", error.what());
    }
  }
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
