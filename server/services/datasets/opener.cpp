#include "server/services/datasets/opener.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "terrain/base/caught.h"

namespace tind::services {
namespace {

Result<Dataset> opened(const Opener::Open& open) {
  try {
    return open();
  } catch (const std::exception& error) {
    return std::unexpected(caught(error));
  }
}

}  // namespace

Opener::Opener(int threads) {
  for (int i = 0; i < threads; ++i)
    threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
}

Opener::~Opener() {
  for (std::jthread& thread : threads_) thread.request_stop();
}

void Opener::begin(const std::string& key, Open open) {
  const std::lock_guard lock(mutex_);
  if (!jobs_.try_emplace(key, Job{std::move(open), ++begun_, false, std::nullopt}).second) return;
  queue_.push_back(key);
  changed_.notify_all();
}

std::optional<Result<Dataset>> Opener::take(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto job = jobs_.find(key);
  if (job == jobs_.end() || !job->second.done) return {};
  auto done = std::move(job->second.done);
  jobs_.erase(job);
  return done;
}

void Opener::keep(const std::set<std::string>& keys) {
  std::vector<Job> dropped;  // closing what was opened may take its time
  const std::lock_guard lock(mutex_);
  for (auto job = jobs_.begin(); job != jobs_.end();) {
    if (keys.contains(job->first)) {
      ++job;
      continue;
    }
    dropped.push_back(std::move(job->second));
    job = jobs_.erase(job);
  }
  changed_.notify_all();
}

void Opener::wait_until(Clock::time_point end) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, end, [this] {
    return std::ranges::all_of(jobs_, [](const auto& job) { return job.second.done.has_value(); });
  });
}

void Opener::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (!changed_.wait(lock, stop, [this] { return !queue_.empty(); })) return;
    const std::string key = std::move(queue_.front());
    queue_.pop_front();
    const auto job = jobs_.find(key);
    if (job == jobs_.end() || job->second.begun) continue;
    job->second.begun = true;
    const Open open = job->second.open;
    const std::uint64_t number = job->second.number;
    lock.unlock();
    auto result = opened(open);
    lock.lock();
    // It may be that nobody wants it any more, or wants it again.
    const auto still = jobs_.find(key);
    if (still != jobs_.end() && still->second.number == number)
      still->second.done = std::move(result);
    changed_.notify_all();
    if (stop.stop_requested()) return;
  }
}

}  // namespace tind::services
