#pragma once
// Opens datasets on threads of its own, a few at a time, so that one that takes long (a large zip,
// a disk that hangs) holds up neither the others nor who asks for them.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/dataset/dataset.h"

namespace tind::services {

/// Thread-safe.
class Opener {
 public:
  using Open = std::function<Result<Dataset>()>;
  using Clock = std::chrono::steady_clock;

  explicit Opener(int threads);
  /// Waits for what is under way; what has not begun is dropped.
  ~Opener();
  Opener(const Opener&) = delete;
  Opener& operator=(const Opener&) = delete;

  /// To be opened under this key, unless it is already. What `open` throws is its error.
  void begin(const std::string& key, Open open);
  /// What came of it, once; nothing where it is not done yet, or nobody asked for it.
  std::optional<Result<Dataset>> take(const std::string& key);
  /// Only these are still wanted: others are dropped, those under way when they are done.
  void keep(const std::set<std::string>& keys);
  /// Until all that was begun is done, or it is that late.
  void wait_until(Clock::time_point);

 private:
  struct Job {
    Open open;
    std::uint64_t number = 0;  // of all that were begun: a key may be dropped and wanted again
    bool begun = false;
    std::optional<Result<Dataset>> done;
  };
  void work(const std::stop_token&);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Job> jobs_;
  std::uint64_t begun_ = 0;
  std::deque<std::string> queue_;  // keys; some may be dropped by now
  std::vector<std::jthread> threads_;
};

}  // namespace tind::services
