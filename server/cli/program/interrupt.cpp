#include "server/cli/program/interrupt.h"

#include <csignal>
#include <cstdlib>
#include <stop_token>
#include <utility>

#include "server/cli/program/exit.h"

namespace tind::cli {
namespace {

std::stop_source& interrupted() {
  static std::stop_source source;
  return source;
}
volatile std::sig_atomic_t signal_seen = 0;

/// A handler may only set a flag.
void on_signal(int) {
  if (signal_seen) std::_Exit(kTryAgain);
  signal_seen = 1;
}

}  // namespace

void finish_on_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

Progress stoppable(ProgressBar& bar) {
  Progress progress = bar.progress(interrupted().get_token());
  progress.report = [shown = std::move(progress.report)](double share) {
    if (signal_seen) interrupted().request_stop();
    if (shown) shown(share);
  };
  return progress;
}

}  // namespace tind::cli
