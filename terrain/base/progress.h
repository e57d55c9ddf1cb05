#pragma once
// What long work takes along: a way to say how far it is, and a way to be told to stop.

#include <functional>
#include <stop_token>

namespace tind {

struct Progress {
  /// Called with a share in 0..1, from any thread, at most a few hundred times a job. May be empty.
  std::function<void(double)> report;
  std::stop_token stop;

  void at(double share) const {
    if (report) report(share);
  }
  bool stopped() const { return stop.stop_requested(); }
};

}  // namespace tind
