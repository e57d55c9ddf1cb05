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
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "server/log/log_limiter.h"
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
constexpr std::size_t kMostTexts = 256;  // told apart in kWindow; others are only counted
constexpr std::chrono::milliseconds kFarewell{300};

constexpr std::string_view kRequest = " request=";  // before the name of the request a line is of

std::atomic<std::uint64_t> dropped_lines{0}, repeated_lines{0};

std::string text_of(const Access& access) {
  const bool refused = !access.refused.empty();
  std::string text = fmt::format("{} {} {} {} {:.3f} ms {}", refused ? "refused:" : access.method,
                                 refused ? access.refused : access.target, access.status,
                                 access.bytes, access.milliseconds, access.client);
  if (!access.request.empty()) text.append(kRequest).append(access.request);
  return text;
}

/// The fields of a line beyond time, level and message.
nlohmann::ordered_json fields_of(const Access& access) {
  nlohmann::ordered_json fields;
  if (access.refused.empty()) {
    fields["method"] = access.method;
    fields["target"] = access.target;
  } else {
    fields["refused"] = access.refused;
  }
  fields["status"] = access.status;
  fields["bytes"] = access.bytes;
  fields["milliseconds"] = std::round(access.milliseconds * 1e3) / 1e3;
  fields["client"] = access.client;
  return fields;
}

/// The name of the request goes from the message into a field of its own.
nlohmann::ordered_json take_request(std::string& message) {
  nlohmann::ordered_json fields = nlohmann::ordered_json::object();
  const auto at = message.find(kRequest);
  if (at == message.npos) return fields;
  const auto begin = at + kRequest.size(), end = std::min(message.find(' ', begin), message.size());
  fields["request"] = message.substr(begin, end - begin);
  message.erase(at, end - at);
  return fields;
}

}  // namespace

class LogSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  LogSink(Form form, int fd) : form_(form), fd_(fd) {
    writer_ = std::jthread([this](std::stop_token stop) { write_lines(stop); });
  }
  ~LogSink() override { end(); }

  void say(const Access& access) {
    const std::string text = text_of(access);
    const std::lock_guard lock(mutex_);
    say(spdlog::details::log_msg("tind", spdlog::level::info, text), fields_of(access));
  }

  /// Idempotent.
  void end() {
    writer_.request_stop();
    if (writer_.joinable()) writer_.join();
  }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    if (message.level >= spdlog::level::warn && !may_say(text, Clock::now())) {
      repeated_lines.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    say(message);
  }
  void flush_() override {}

  /// Under the sink's mutex.
  bool may_say(std::string_view text, Clock::time_point now) {
    tell(limiter_.forget(now));
    return limiter_.take(text.substr(0, text.find(kRequest)), now).has_value();
  }

  /// As the pattern has it: all of a line of text, an object's time.
  std::string formatted(const spdlog::details::log_msg& message) {
    spdlog::memory_buf_t buffer;
    formatter_->format(message, buffer);
    return {buffer.data(), buffer.size() - 1};  // without the end of line
  }

  std::string line(const spdlog::details::log_msg& message) {
    return printable(formatted(message)) + "\n";
  }

  std::string object(const spdlog::details::log_msg& message, const nlohmann::ordered_json& more) {
    const auto level = spdlog::level::to_string_view(message.level);
    std::string text(message.payload.data(), message.payload.size());
    const auto request = take_request(text);
    nlohmann::ordered_json all = {{"time", formatted(message)},
                                  {"level", std::string_view(level.data(), level.size())},
                                  {"message", std::move(text)}};
    all.update(more);
    all.update(request);
    return all.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  }

  /// Under the sink's mutex. `more`: an object's further fields.
  void say(const spdlog::details::log_msg& message,
           const nlohmann::ordered_json& more = nlohmann::ordered_json::object()) {
    put(form_ == Form::json ? object(message, more) : line(message));
  }

  void put(std::string line) {
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
    say(spdlog::details::log_msg("tind", level, text));
  }

  /// Under the sink's mutex.
  void tell(const std::vector<LogLimiter::Unsaid>& repeated) {
    for (const auto& [text, times] : repeated)
      say(spdlog::level::warn,
          fmt::format("{} (repeated {} times)", text.empty() ? "(other messages)" : text, times));
  }

  void tell_repetitions(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    tell(limiter_.forget(now));
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
      tell_repetitions(Clock::now());
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

  const Form form_;
  const int fd_;
  LogLimiter limiter_{kWindow, kMostTexts, kEqualLines};
  std::mutex lines_mutex_;
  std::condition_variable_any wake_;
  std::deque<std::string> lines_;
  std::size_t waiting_ = 0;  // bytes: of lines_, and of the one being written
  std::uint64_t missing_ = 0;
  Clock::time_point farewell_ends_{};  // the writer's own
  std::jthread writer_;                // last: it works on all of these
};

Log::Log(const std::string& level, Form form, int fd) : sink_(std::make_shared<LogSink>(form, fd)) {
  auto logger = std::make_shared<spdlog::logger>("tind", sink_);
  const std::string time = "%Y-%m-%dT%H:%M:%S.%e%z";
  logger->set_pattern(form == Form::text ? time + " %l %v" : time);
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

Log::~Log() { sink_->end(); }

void log_access(const Access& access) {
  const spdlog::logger& logger = *spdlog::default_logger_raw();
  if (!logger.should_log(spdlog::level::info)) return;
  for (const auto& sink : logger.sinks())
    if (auto* const own = dynamic_cast<LogSink*>(sink.get())) return own->say(access);
  spdlog::info("{}", text_of(access));  // nobody made a Log
}

LogCounts log_counts() {
  return {dropped_lines.load(std::memory_order_relaxed),
          repeated_lines.load(std::memory_order_relaxed)};
}

}  // namespace tind::logging
