#pragma once
// How far a long command is, on stderr: a bar with the time left on a terminal (after the first
// second), elsewhere a plain line every few seconds, and nothing at all for quick runs.

#include <chrono>
#include <memory>
#include <string>

#include "terrain/base/progress.h"

namespace tind::cli {

enum class ProgressStyle {
  automatic,  // bar on a terminal, lines otherwise
  bar,
  lines,
  none,
};

/// The style named automatic|bar|lines|none; `auto` too.
ProgressStyle progress_style(const std::string& name);

/// Shows one job's progress for as long as it lives; wipes the bar when it goes.
class ProgressBar {
 public:
  ProgressBar(std::string label, ProgressStyle style);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// To be handed to the library; may be called from any thread. Valid while the bar lives.
  Progress progress(std::stop_token stop = {});

  /// The share done, 0..1, and a few words to show behind it ("1,204 tiles").
  void at(double share, const std::string& detail = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// "1:05:03", "12:40", "9 s".
std::string duration_text(double seconds);

}  // namespace tind::cli
