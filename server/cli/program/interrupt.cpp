#include "server/cli/program/interrupt.h"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "server/cli/program/exit.h"

namespace tind::cli {
namespace {

std::stop_source& interrupted() {
  static std::stop_source source;
  return source;
}
/// Other threads look at it. Without a lock, so that a handler may set it.
std::atomic<bool> signal_seen = false;
static_assert(std::atomic<bool>::is_always_lock_free);

/// A handler may only set a flag. A terminal that goes says so twice: that is nobody who insists.
void on_signal(int number) {
  if (signal_seen.exchange(true) && number != SIGHUP) std::_Exit(kTryAgain);
}

}  // namespace

void finish_on_signals() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP})
    if (std::signal(number, on_signal) == SIG_IGN)  // nohup means it
      std::signal(number, SIG_IGN);
}

Progress stoppable(ProgressBar& bar) {
  Progress progress = bar.progress(interrupted().get_token());
  progress.report = [shown = std::move(progress.report)](double share) {
    if (signal_seen) interrupted().request_stop();
    if (shown) shown(share);
  };
  return progress;
}

struct GraceWatch::State {
  std::stop_source finish, abandon;
  std::jthread thread;
};

GraceWatch::GraceWatch(double grace_s) : state_(std::make_unique<State>()) {
  finish_on_signals();
  state_->thread = std::jthread([s = state_.get(), grace_s](std::stop_token stop) {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> since;
    while (!stop.stop_requested()) {
      if (signal_seen) {
        if (!since) since = Clock::now();
        s->finish.request_stop();
        const double passed = std::chrono::duration<double>(Clock::now() - *since).count();
        if (passed > grace_s * 2 / 3) s->abandon.request_stop();
        if (passed > grace_s) std::_Exit(kTryAgain);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
}

GraceWatch::~GraceWatch() = default;

std::stop_token GraceWatch::finish() const { return state_->finish.get_token(); }
std::stop_token GraceWatch::abandon() const { return state_->abandon.get_token(); }

}  // namespace tind::cli
