#pragma once
// Of all who want the same thing at the same time, one makes it and the others wait for it. When
// all of them have gone, whoever makes it is told.

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "terrain/base/result.h"

namespace tind::services {

/// Thread-safe. Outlives what it calls, and the tokens' callbacks.
template <class Key, class Value>
class SingleFlight {
 public:
  using Done = std::move_only_function<void(Result<Value>)>;
  class Flight;
  using Ticket = std::shared_ptr<Flight>;

  /// Not null for the first who asks: it must call land() in the end, whatever happens. `gone`: who
  /// asks has left, and is answered all the same.
  Ticket join(const Key& key, Done done, std::stop_token gone = {}) {
    const auto waiter = std::make_shared<Waiter>(std::move(done));
    Ticket flight;
    bool first = false;
    {
      const std::lock_guard lock(mutex_);
      Ticket& here = flights_[key];
      first = !here;
      if (first) here = std::make_shared<Flight>(key);
      flight = here;
      flight->waiters_.push_back(waiter);
      ++flight->present_;
    }
    waiter->leaves.emplace(std::move(gone), Leave{this, flight});  // it may have gone already
    return first ? flight : nullptr;
  }

  /// Answers all who wait, from this thread. Who asks from now on begins anew.
  void land(const Ticket& flight, const Result<Value>& result) {
    std::vector<std::shared_ptr<Waiter>> waiters;
    {
      const std::lock_guard lock(mutex_);
      waiters.swap(flight->waiters_);
      forget(*flight);
    }
    for (const auto& waiter : waiters) waiter->done(result);
  }

 private:
  struct Leave {
    SingleFlight* from;
    std::weak_ptr<Flight> flight;
    void operator()() const {
      if (const Ticket here = flight.lock()) from->leave(*here);
    }
  };
  struct Waiter {
    explicit Waiter(Done d) : done(std::move(d)) {}
    Done done;
    std::optional<std::stop_callback<Leave>> leaves;
  };

  /// Under the lock.
  void forget(const Flight& flight) {
    const auto found = flights_.find(flight.key_);
    if (found != flights_.end() && found->second.get() == &flight) flights_.erase(found);
  }
  void leave(Flight& flight) {
    {
      const std::lock_guard lock(mutex_);
      if (--flight.present_ > 0) return;
      forget(flight);  // who asks from now on must not join what ends
    }
    flight.abandoned_.request_stop();
  }

  std::mutex mutex_;
  std::map<Key, Ticket> flights_;
};

template <class Key, class Value>
class SingleFlight<Key, Value>::Flight {
 public:
  explicit Flight(const Key& key) : key_(key) {}
  /// Stopped when nobody waits any more.
  std::stop_token abandoned() const { return abandoned_.get_token(); }

 private:
  friend class SingleFlight;
  const Key key_;
  std::vector<std::shared_ptr<Waiter>> waiters_;
  std::size_t present_ = 0;
  std::stop_source abandoned_;
};

}  // namespace tind::services
