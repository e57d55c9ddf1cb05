// A process ends with the thread that began it, so that none outlives the daemon even when that is
// killed. Threads of the daemon come and go; so one that stays begins them all.

#include "terrain/raster/sandbox/team.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tind::sandbox {

Team::Team(TeamOptions options)
    : options_(std::move(options)),
      launcher_([this](const std::stop_token& stop) { launch(stop); }) {}

Team::~Team() = default;

/// By the launcher, with which all that is begun ends.
Result<pid_t> Team::begin(const Descriptors& descriptors) {
  if (options_.nursery.empty()) return spawn(options_.command, descriptors);
  if (!nursery_) nursery_ = std::make_unique<Nursery>(options_.nursery);
  if (auto process = nursery_->begin(descriptors)) return process;
  return spawn(options_.command, descriptors);
}

void Team::launch(const std::stop_token& stop) {
  std::unique_lock lock(launching_);
  while (wanted_.wait(lock, stop, [this] { return !launches_.empty(); })) {
    auto task = std::move(launches_.front());
    launches_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
  lock.unlock();
  nursery_.reset();
}

/// One after the other: a start is tens of milliseconds, and rare.
Team::Started Team::start(const std::string& brief) {
  std::packaged_task<Started()> task(
      [&] { return Decoder::start(std::bind_front(&Team::begin, this), brief, options_.read); });
  auto started = task.get_future();
  {
    const std::lock_guard lock(launching_);
    launches_.push_back(std::move(task));
  }
  wanted_.notify_one();
  return started.get();
}

std::uint64_t Team::new_crew() {
  const std::lock_guard lock(mutex_);
  return ++crews_;
}

Result<std::unique_ptr<Decoder>> Team::take(std::uint64_t crew, const std::string& brief) {
  std::list<Idle> ended;  // after the lock is gone
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto own = std::ranges::find(idle_, crew, &Idle::crew);
    if (own != idle_.end() && own->decoder->alive()) {
      auto decoder = std::move(own->decoder);
      idle_.erase(own);
      return decoder;
    }
    if (own != idle_.end()) {  // the system was short of memory, say
      ended.splice(ended.end(), idle_, own);
      --running_;
      continue;
    }
    if (running_ < options_.most) break;
    if (!idle_.empty()) {
      ended.splice(ended.end(), idle_, std::prev(idle_.end()));
      --running_;
      break;
    }
    freed_.wait(lock);
  }
  ++running_;
  lock.unlock();
  ended.clear();
  auto decoder = start(brief);
  if (!decoder) give(crew, nullptr);
  return decoder;
}

void Team::give(std::uint64_t crew, std::unique_ptr<Decoder> decoder) {
  if (decoder && (decoder->busy() > options_.busy || !decoder->alive())) decoder.reset();
  {
    const std::lock_guard lock(mutex_);
    if (decoder)
      idle_.push_front({crew, std::move(decoder)});
    else
      --running_;
  }
  freed_.notify_all();
}

void Team::dismiss(std::uint64_t crew) {
  std::list<Idle> ended;
  {
    const std::lock_guard lock(mutex_);
    for (auto it = idle_.begin(); it != idle_.end();) {
      const auto here = it++;
      if (here->crew == crew) ended.splice(ended.end(), idle_, here);
    }
    running_ -= ended.size();
  }
  freed_.notify_all();
}

std::size_t Team::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

}  // namespace tind::sandbox
