#pragma once
// Ctrl-C, SIGTERM and a terminal that goes (SIGHUP), unless ignored as by nohup, for commands that
// write many files: what is at hand is finished.

#include <memory>
#include <stop_token>

#include "server/cli/program/progress_bar.h"

namespace tind::cli {

/// From now on a first signal stops what runs under stoppable() at its next report; a second one
/// ends the program at once.
void finish_on_signals();

/// The bar's progress, which such a signal stops.
Progress stoppable(ProgressBar&);

/// For work whose steps may take long, and which must end within a time. From now on a first signal
/// asks to finish within a tenth of a second; after two thirds of the time it asks to abandon what
/// is at hand; when the time is over the program ends at once, with kTryAgain, as it does at a
/// second signal.
class GraceWatch {
 public:
  explicit GraceWatch(double grace_s);
  ~GraceWatch();
  GraceWatch(const GraceWatch&) = delete;
  GraceWatch& operator=(const GraceWatch&) = delete;
  std::stop_token finish() const;
  std::stop_token abandon() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tind::cli
