#pragma once
// The processes that decode for one daemon: a crew for each DEM, which may open that DEM's files
// and no others, and one bound of processes for all crews.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/sandbox/decoder.h"
#include "terrain/raster/sandbox/nursery.h"

namespace tind::sandbox {

struct TeamOptions {
  std::vector<std::string> command;  // a program that is a decoder, and its arguments
  std::vector<std::string> nursery;  // the same that calls nurse(); empty: `command` each time
  std::size_t most = 16;             // processes
  Patience open{std::chrono::seconds(120), std::chrono::minutes(20)};
  Patience read{std::chrono::seconds(20), std::chrono::minutes(2)};
  std::chrono::milliseconds busy{std::chrono::minutes(20)};  // then a process has done its share
  std::chrono::milliseconds first_pause{1000}, last_pause{60'000};  // after what ended a process
};

/// Thread-safe.
class Team {
 public:
  explicit Team(TeamOptions);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;
  const TeamOptions& options() const { return options_; }

  /// A number for a crew, never used twice.
  std::uint64_t new_crew();
  /// A process of the crew that nobody uses, or a new one; where there are as many as there may be,
  /// the longest unused of other crews ends, or it is waited for one.
  Result<std::unique_ptr<Decoder>> take(std::uint64_t crew, const std::string& brief);
  /// Back, to be used again, where it may be. nullptr: it is gone.
  void give(std::uint64_t crew, std::unique_ptr<Decoder>);
  /// Nobody will ask for this crew any more.
  void dismiss(std::uint64_t crew);
  /// Processes that there are just now.
  std::size_t running() const;

 private:
  struct Idle {
    std::uint64_t crew;
    std::unique_ptr<Decoder> decoder;
  };
  using Started = Result<std::unique_ptr<Decoder>>;
  Started start(const std::string& brief);
  Result<pid_t> begin(const Descriptors&);
  void launch(const std::stop_token&);

  const TeamOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable freed_;
  std::list<Idle> idle_;  // most recently used first
  std::size_t running_ = 0;
  std::uint64_t crews_ = 0;

  std::unique_ptr<Nursery> nursery_;  // of the launcher
  std::mutex launching_;
  std::condition_variable_any wanted_;
  std::deque<std::packaged_task<Started()>> launches_;
  std::jthread launcher_;  // last: it uses the others
};

}  // namespace tind::sandbox
