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

  /// The progress of a part of the job: its 0..1 is from..to here. Valid while this one lives.
  Progress part(double from, double to) const {
    Progress p;
    if (report) p.report = [this, from, to](double share) { at(from + share * (to - from)); };
    p.stop = stop;
    return p;
  }
};

}  // namespace tind
