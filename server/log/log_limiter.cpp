#include "server/log/log_limiter.h"

#include <algorithm>
#include <utility>

namespace tind::logging {

std::optional<std::uint64_t> LogLimiter::take(std::string_view cause, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  auto found = causes_.find(cause);
  if (found == causes_.end()) {
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
    found = causes_.emplace(cause, Said{now + period_, 0, std::exchange(others_, 0)}).first;
  } else if (now >= found->second.until) {
    found->second.until = now + period_;
    found->second.said = 0;
  }
  Said& said = found->second;
  first_end_ = std::min(first_end_, said.until);
  if (said.said >= at_once_) {
    ++said.unsaid;
    return {};
  }
  ++said.said;
  return std::exchange(said.unsaid, 0);
}

std::vector<LogLimiter::Unsaid> LogLimiter::forget(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  std::vector<Unsaid> all;
  if (now < first_end_) return all;
  first_end_ = Clock::time_point::max();
  std::erase_if(causes_, [&](const auto& old) {
    const auto& [cause, said] = old;
    if (now < said.until) {
      first_end_ = std::min(first_end_, said.until);
      return false;
    }
    if (said.unsaid > 0) all.push_back({cause, said.unsaid});
    return true;
  });
  if (others_ > 0) all.push_back({{}, std::exchange(others_, 0)});
  return all;
}

}  // namespace tind::logging
