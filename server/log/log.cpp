#include "server/log/log.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "server/log/printable.h"

// A pipe that poll() calls writable takes a page without blocking, which is as much as is written
// at once; so the thread can always be stopped.

namespace tind::logging {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostWaiting = 1 << 20;  // bytes
constexpr std::size_t kAtOnce = 4096;
constexpr int kEqualLines = 5;  // in kWindow
constexpr std::chrono::seconds kWindow{10};
constexpr std::size_t kMostTexts = 256;  // told apart in kWindow; all others count as one
constexpr std::chrono::milliseconds kFarewell{300};

std::atomic<std::uint64_t> dropped_lines{0}, repeated_lines{0};

}  // namespace

/// What was said lately, and how often.
class Repetitions {
 public:
  /// False: it has been said often enough.
  bool may_say(std::string_view text, Clock::time_point now) {
    std::string key(text.substr(0, text.find(" request=")));
    if (!said_.contains(key) && said_.size() >= kMostTexts) key = "(other messages)";
    Said& said = said_[std::move(key)];
    if (said.count == 0) said.since = now;
    return ++said.count <= kEqualLines;
  }
  /// Calls f(text, how often it was not written) for those whose time is over, and forgets them.
  template <class F>
  void forget(Clock::time_point until, F&& f) {
    for (auto it = said_.begin(); it != said_.end();) {
      const auto& [text, said] = *it;
      if (said.since > until) {
        ++it;
        continue;
      }
      if (said.count > kEqualLines) f(text, said.count - kEqualLines);
      it = said_.erase(it);
    }
  }

 private:
  struct Said {
    Clock::time_point since;
    int count = 0;
  };
  std::map<std::string, Said> said_;
};

class LogSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit LogSink(int fd) : fd_(fd) {
    writer_ = std::jthread([this](std::stop_token stop) { write_lines(stop); });
  }
  ~LogSink() override { end(); }

  /// Idempotent.
  void end() {
    writer_.request_stop();
    if (writer_.joinable()) writer_.join();
  }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    if (message.level >= spdlog::level::warn && !repetitions_.may_say(text, Clock::now())) {
      repeated_lines.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    put(message);
  }
  void flush_() override {}

  /// Under the sink's mutex.
  void put(const spdlog::details::log_msg& message) {
    spdlog::memory_buf_t formatted;
    formatter_->format(message, formatted);
    std::string line = printable({formatted.data(), formatted.size() - 1}) + "\n";
    const std::lock_guard lock(lines_mutex_);
    if (waiting_ + line.size() > kMostWaiting) {
      ++missing_;
      dropped_lines.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    waiting_ += line.size();
    lines_.push_back(std::move(line));
    wake_.notify_one();
  }

  void say(spdlog::level::level_enum level, const std::string& text) {
    put(spdlog::details::log_msg("tind", level, text));
  }

  void tell_repetitions(Clock::time_point until) {
    const std::lock_guard lock(mutex_);
    repetitions_.forget(until, [this](const std::string& text, int times) {
      say(spdlog::level::warn, fmt::format("{} (repeated {} times)", text, times));
    });
  }

  void tell_missing() {
    std::uint64_t missing = 0;
    {
      const std::lock_guard lock(lines_mutex_);
      if (waiting_ == 0) missing = std::exchange(missing_, 0);
    }
    if (missing == 0) return;
    const std::lock_guard lock(mutex_);
    say(spdlog::level::warn,
        fmt::format("{} lines of the log are missing here: they were not read in time", missing));
  }

  void write_lines(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      {
        std::unique_lock lock(lines_mutex_);
        wake_.wait_for(lock, stop, std::chrono::seconds(1), [&] { return !lines_.empty(); });
      }
      write_waiting(stop);
      tell_repetitions(Clock::now() - kWindow);
      tell_missing();
    }
    tell_repetitions(Clock::time_point::max());
    write_waiting(stop);
  }

  void write_waiting(const std::stop_token& stop) {
    while (true) {
      std::string line;
      {
        const std::lock_guard lock(lines_mutex_);
        if (lines_.empty()) return;
        line = std::move(lines_.front());
        lines_.pop_front();
      }
      const bool written = write_line(line, stop);
      const std::lock_guard lock(lines_mutex_);
      waiting_ -= line.size();
      if (!written) dropped_lines.fetch_add(1, std::memory_order_relaxed);
    }
  }

  bool write_line(std::string_view line, const std::stop_token& stop) {
    while (!line.empty()) {
      if (stop.stop_requested() && farewell_ends_ == Clock::time_point{})
        farewell_ends_ = Clock::now() + kFarewell;
      if (stop.stop_requested() && Clock::now() > farewell_ends_) return false;
      pollfd ready{fd_, POLLOUT, 0};
      const int polled = ::poll(&ready, 1, 100);
      if (polled < 0 && errno != EINTR) return false;
      if (polled <= 0) continue;
      const ssize_t size = ::write(fd_, line.data(), std::min(line.size(), kAtOnce));
      if (size < 0 && errno != EINTR && errno != EAGAIN) return false;  // nobody reads any more
      if (size > 0) line.remove_prefix(std::size_t(size));
    }
    return true;
  }

  const int fd_;
  Repetitions repetitions_;  // guarded by mutex_
  std::mutex lines_mutex_;
  std::condition_variable_any wake_;
  std::deque<std::string> lines_;
  std::size_t waiting_ = 0;  // bytes: of lines_, and of the one being written
  std::uint64_t missing_ = 0;
  Clock::time_point farewell_ends_{};  // the writer's own
  std::jthread writer_;                // last: it works on all of these
};

Log::Log(const std::string& level, int fd) : sink_(std::make_shared<LogSink>(fd)) {
  auto logger = std::make_shared<spdlog::logger>("tind", sink_);
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

Log::~Log() { sink_->end(); }

LogCounts log_counts() {
  return {dropped_lines.load(std::memory_order_relaxed),
          repeated_lines.load(std::memory_order_relaxed)};
}

}  // namespace tind::logging
