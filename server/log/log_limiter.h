#pragma once
// What goes wrong again and again is said once a while, with how often.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace tind::logging {

/// Thread-safe; bounded, whatever happens and however many different things do.
class LogLimiter {
 public:
  using Clock = std::chrono::steady_clock;
  LogLimiter(std::chrono::milliseconds period, std::size_t most_causes)
      : period_(period), most_causes_(most_causes) {}

  /// Nothing: do not say it. Else how often it has happened unsaid since it was said last; of what
  /// is new, also everything that there was no room to tell apart.
  std::optional<std::uint64_t> take(std::string_view cause, Clock::time_point now = Clock::now());

 private:
  struct Said {
    Clock::time_point until;
    std::uint64_t unsaid = 0;
  };
  const std::chrono::milliseconds period_;
  const std::size_t most_causes_;
  std::mutex mutex_;
  std::map<std::string, Said, std::less<>> causes_;
  std::uint64_t others_ = 0;
};

}  // namespace tind::logging
