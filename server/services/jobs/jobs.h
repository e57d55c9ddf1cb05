#pragma once
// Long work for clients, each piece in a process of its own, so that none takes the daemon's memory
// or time, or takes it down; kept on disk, so that a restart goes on with it or says why not.
//
// A job's folder holds what it was given and what it makes. The list is written first and last: a
// result that the list does not call successful is none.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/services/jobs/child_process.h"
#include "server/services/jobs/job.h"
#include "server/services/jobs/job_order.h"
#include "server/services/jobs/job_store.h"
#include "server/services/jobs/lent_results.h"
#include "terrain/base/result.h"

namespace tind::services {

struct JobLimits {
  int running = 1;                                      // at a time
  std::size_t waiting = 64;                             // beside them
  std::size_t per_client = 8;                           // of one client, waiting or running
  std::uint64_t stored_bytes = std::uint64_t(4) << 30;  // of all jobs' files
  std::uint64_t stored_per_client = std::uint64_t(2) << 30;
  std::chrono::seconds kept{24 * 3600};  // after their end
  ChildLimits each{};                    // file_bytes: of its results, too
};

class Jobs {
 public:
  using Done = std::move_only_function<void(const Job&)>;
  /// Fails unless what it reads is as it was when it was asked for; from any thread.
  using Unchanged = std::function<Result<void>()>;

  /// `folder`: made if need be; empty: a temporary one, which goes with the daemon, or, where that
  /// was killed, with the next one of the same user. `program`: what runs. What an earlier daemon
  /// left unfinished is begun again, once; and so is what somebody else has killed.
  static Result<std::unique_ptr<Jobs>> open(const std::string& folder, const std::string& program,
                                            const JobLimits&);
  ~Jobs();
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  /// A new job. `done` is called once it has ended, from another thread, with the job as it ended,
  /// or as it is when the daemon stops before; `gone`: nobody waits for it any more. Fails (busy)
  /// when there is no room: of this client, of all, or on the disk; the error says which.
  /// `unchanged` is asked before it runs and once it has; where there is none, and after a
  /// restart, its sources are to be the files that they were.
  Result<Job> submit(const JobOrder&, Done done = {}, std::stop_token gone = {},
                     Unchanged unchanged = {});

  /// Where its folder has gone, or may not be written to, no job finds a place: errno, or 0; where
  /// somebody has removed or replaced the list of jobs in it, kOtherList. As the last order or
  /// sweep (one a minute) found it; never waits for a disk.
  int unwritable() const { return unwritable_; }
  static constexpr int kOtherList = -1;

  Result<std::optional<Job>> find(std::string_view id) const;
  Result<std::vector<Job>> of_client(std::string_view client, std::size_t most) const;
  /// Stops it, drops its files and calls it dismissed. Nothing where there is none of that id.
  Result<std::optional<Job>> dismiss(std::string_view id);
  /// Drops one that has ended, as if it had never been.
  void forget(const Job&);

  /// Where an output of a successful job lies.
  std::string path_of(const Job&, const JobOrder::Output&) const;
  /// Are there as many bytes as it made? What was cut since is no result. Fails where its files
  /// cannot be looked at.
  Result<bool> is_whole(const Job&) const;
  /// To be held by whoever sends files of the job: they count until then, removed or not.
  LentResults::Loan lend(const Job& job) const { return lent_.lend(job); }
  const JobLimits& limits() const { return limits_; }

  struct Counts {
    std::size_t waiting = 0, running = 0;
    std::uint64_t successful = 0, failed = 0, dismissed = 0;  // since the start
  };
  Counts counts() const;  // never waits for a disk

  /// Ends what runs, which begins again at the next start, and joins. Idempotent.
  void stop();

 private:
  /// One that has not ended.
  struct Live {
    Job job;  // its order only while it runs: of all that wait they would be gigabytes
    std::uint64_t order_bytes = 0;
    std::stop_source stop;
    bool running = false;
    std::atomic<bool> dismissed = false;
    Done done;
    Unchanged unchanged;
    struct Leave {
      Live* live;
      void operator()() const {
        live->dismissed = true;
        live->stop.request_stop();
      }
    };
    std::optional<std::stop_callback<Leave>> gone;
  };
  Jobs(std::string folder, bool temporary, std::string program, const JobLimits& limits,
       std::unique_ptr<JobStore> store);

  static Job seen(const Live&);
  void drop_left();
  Result<void> recover();
  void work(const std::stop_token&);
  std::shared_ptr<Live> take(std::vector<std::string>::iterator queued);
  void run(const std::shared_ptr<Live>&, const std::stop_token&);
  struct Said;
  void hear(Live&, std::string_view line, Said&) const;
  /// Of one whose program ended without having done it, or whose daemon stops.
  void put_back(const std::shared_ptr<Live>&);
  void end(const std::shared_ptr<Live>&, JobStatus, std::string message);
  void sweep();
  int in_the_way() const;
  Result<void> can_keep();
  std::string folder_of(std::string_view id) const;
  std::optional<Error> no_room(const Live&) const;
  bool may_begin() const;
  bool may_begin_of(const std::string& client) const;
  std::vector<std::string>::iterator next_in_queue();
  void count_stored_of(const std::string& client);
  const char* no_room_for_results(const std::string& client) const;
  void count_stored();

  const std::string folder_, program_;
  const bool temporary_;
  const JobLimits limits_;
  // Of the thread that sweeps: when it did last, by both clocks, and until when nothing is
  // forgotten.
  std::int64_t swept_ms_ = now_ms();
  std::chrono::steady_clock::time_point swept_ = std::chrono::steady_clock::now(), hold_ = swept_;
  const std::unique_ptr<JobStore> store_;

  mutable LentResults lent_;

  mutable std::mutex mutex_;  // of these
  std::condition_variable_any wake_;
  std::map<std::string, std::shared_ptr<Live>, std::less<>> live_;
  std::vector<std::string> queue_;              // ids, the oldest first
  std::map<std::string, std::uint64_t> turns_;  // of clients that have any: which was their last
  std::uint64_t turn_ = 0;
  std::map<std::string, std::uint64_t> stored_of_;  // clients that have any live: of their results
  Counts counts_;
  std::atomic<std::uint64_t> stored_bytes_ = 0;  // of results, as the list said when last asked
  mutable std::mutex last_mutex_;                // of what counts() said last
  mutable Counts last_;
  bool stopping_ = false;
  std::atomic<int> unwritable_ = 0;
  std::map<std::string, Job, std::less<>> unsaved_;  // ended, and the disk did not take it

  std::vector<std::jthread> threads_;
};

}  // namespace tind::services
