#pragma once
// Of all who want the same thing at the same time, one makes it and the others wait for it.

#include <functional>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "terrain/base/result.h"

namespace tind::services {

/// Thread-safe.
template <class Key, class Value>
class SingleFlight {
 public:
  using Done = std::move_only_function<void(Result<Value>)>;

  /// True for the first who asks: it must call land() in the end, whatever happens.
  bool join(const Key& key, Done done) {
    const std::lock_guard lock(mutex_);
    auto& waiters = flights_[key];
    waiters.push_back(std::move(done));
    return waiters.size() == 1;
  }

  /// Answers all who wait, from this thread. Who asks from now on begins anew.
  void land(const Key& key, const Result<Value>& result) {
    std::vector<Done> waiters;
    {
      const std::lock_guard lock(mutex_);
      const auto flight = flights_.find(key);
      waiters.swap(flight->second);
      flights_.erase(flight);
    }
    for (Done& done : waiters) done(result);
  }

 private:
  std::mutex mutex_;
  std::map<Key, std::vector<Done>> flights_;
};

}  // namespace tind::services
