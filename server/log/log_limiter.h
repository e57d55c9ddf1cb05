#pragma once
// What goes wrong again and again is said a few times in a while, with how often.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tind::logging {

/// Thread-safe; bounded, whatever happens and however many different things do.
class LogLimiter {
 public:
  using Clock = std::chrono::steady_clock;
  /// Of each cause the first `at_once` in a period are said.
  LogLimiter(std::chrono::milliseconds period, std::size_t most_causes, int at_once = 1)
      : period_(period), most_causes_(most_causes), at_once_(at_once) {}

  /// Nothing: do not say it. Else how often it has happened unsaid since it was said last; of what
  /// is new, also everything that there was no room to tell apart.
  std::optional<std::uint64_t> take(std::string_view cause, Clock::time_point now = Clock::now());

  struct Unsaid {
    std::string cause;
    std::uint64_t times;
  };
  /// Forgets causes whose period is over, and gives those of them that happened unsaid; as one,
  /// without a name, what there was no room to tell apart. Costs nothing while no period is over.
  std::vector<Unsaid> forget(Clock::time_point now = Clock::now());

 private:
  struct Said {
    Clock::time_point until;
    int said = 0;
    std::uint64_t unsaid = 0;
  };
  const std::chrono::milliseconds period_;
  const std::size_t most_causes_;
  const int at_once_;
  std::mutex mutex_;
  std::map<std::string, Said, std::less<>> causes_;
  Clock::time_point first_end_ = Clock::time_point::max();  // of a period, or before it
  std::uint64_t others_ = 0;
};

}  // namespace tind::logging
