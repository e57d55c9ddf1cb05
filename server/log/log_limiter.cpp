#include "server/log/log_limiter.h"

#include <utility>

namespace tind::logging {

std::optional<std::uint64_t> LogLimiter::take(std::string_view cause, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto found = causes_.find(cause);
  if (found != causes_.end()) {
    if (now < found->second.until) {
      ++found->second.unsaid;
      return {};
    }
    found->second.until = now + period_;
    return std::exchange(found->second.unsaid, 0);
  }
  if (causes_.size() >= most_causes_)
    std::erase_if(causes_, [&](const auto& old) {
      if (now < old.second.until) return false;
      others_ += old.second.unsaid;
      return true;
    });
  if (causes_.size() >= most_causes_) {
    ++others_;
    return {};
  }
  causes_.emplace(cause, Said{now + period_, 0});
  return std::exchange(others_, 0);
}

}  // namespace tind::logging
