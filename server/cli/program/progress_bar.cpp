#include "server/cli/program/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

namespace tind::cli {

namespace {

using Clock = std::chrono::steady_clock;
constexpr double kQuiet = 1.0;    // seconds before the first word
constexpr double kBetween = 0.1;  // seconds between two drawings of the bar
constexpr double kBetweenLines = 3, kLongestSilence = 30;
constexpr int kWidth = 30;

double since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

}  // namespace

struct ProgressBar::State {
  std::string label;
  bool bar = false, lines = false;
  std::mutex mutex;
  Clock::time_point start = Clock::now(), drawn = start;
  bool shown = false;
  int tenths = 0;

  std::string remaining(double share) const {
    if (share <= 0) return {};
    return duration_text(since(start) * (1 - share) / share) + " left";
  }

  void draw_bar(double share, const std::string& detail) {
    if (since(drawn) < kBetween) return;
    drawn = Clock::now();
    shown = true;
    const int full = int(share * kWidth);
    std::fprintf(stderr, "\r\x1b[K%s [%s%s] %3.0f %%  %s%s%s", label.c_str(),
                 std::string(std::size_t(full), '#').c_str(),
                 std::string(std::size_t(kWidth - full), '.').c_str(), 100 * share,
                 remaining(share).c_str(), detail.empty() ? "" : "  ", detail.c_str());
    std::fflush(stderr);
  }

  void draw_line(double share, const std::string& detail) {
    const double silence = since(drawn);
    if (silence < (int(share * 10) > tenths ? kBetweenLines : kLongestSilence)) return;
    drawn = Clock::now();
    tenths = int(share * 10);
    std::fprintf(stderr, "%s: %d %%, %s%s%s\n", label.c_str(), int(share * 100),
                 remaining(share).c_str(), detail.empty() ? "" : ", ", detail.c_str());
  }
};

ProgressStyle progress_style(const std::string& name) {
  if (name == "bar") return ProgressStyle::bar;
  if (name == "lines") return ProgressStyle::lines;
  if (name == "none") return ProgressStyle::none;
  return ProgressStyle::automatic;
}

ProgressBar::ProgressBar(std::string label, ProgressStyle style)
    : state_(std::make_unique<State>()) {
  if (style == ProgressStyle::automatic)
    style = isatty(STDERR_FILENO) ? ProgressStyle::bar : ProgressStyle::lines;
  state_->label = std::move(label);
  state_->bar = style == ProgressStyle::bar;
  state_->lines = style == ProgressStyle::lines;
}

ProgressBar::~ProgressBar() {
  if (state_->bar && state_->shown) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::at(double share, const std::string& detail) {
  State& s = *state_;
  if (!s.bar && !s.lines) return;
  const std::lock_guard lock(s.mutex);
  share = std::clamp(share, 0.0, 1.0);
  if (since(s.start) < kQuiet) return;
  if (s.bar)
    s.draw_bar(share, detail);
  else
    s.draw_line(share, detail);
}

Progress ProgressBar::progress(std::stop_token stop) {
  return {[this](double share) { at(share); }, std::move(stop)};
}

std::string duration_text(double seconds) {
  const std::int64_t s = std::llround(seconds);
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{}:{:02}", s / 60, s % 60);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

}  // namespace tind::cli
