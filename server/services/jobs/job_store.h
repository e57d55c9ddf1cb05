#pragma once
// The jobs of a daemon in a file, so that a restart knows them all.

#include <cstdint>
#include <expected>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/services/jobs/job.h"
#include "terrain/base/result.h"
#include "terrain/base/sqlite.h"

namespace tind::services {

/// Thread-safe. What has been put is there after a power cut.
class JobStore {
 public:
  /// Opens or makes the file. Fails (io), naming it, where it cannot, (bad_data) where it is of
  /// something else, (busy) where another daemon has it.
  static Result<std::unique_ptr<JobStore>> open(const std::string& path);
  JobStore(const JobStore&) = delete;
  JobStore& operator=(const JobStore&) = delete;

  /// Whether it was made when it was opened.
  bool is_new() const { return is_new_; }

  /// Whether its path still names the file that was opened: what is put into one that somebody has
  /// removed or replaced, no restart finds. Fails with errno where the system does not say.
  std::expected<bool, int> is_in_place() const;

  /// A new one, or in place of the one with its id, whose order stays where this has none.
  Result<void> put(const Job&);
  Result<std::optional<Job>> find(std::string_view id) const;
  /// The latest first, without their orders.
  Result<std::vector<Job>> of_client(std::string_view client, std::size_t most) const;
  /// The oldest first; without their orders, whose sizes are said as `bytes`.
  Result<std::vector<Job>> unfinished() const;
  Result<std::vector<Job>> finished_before(std::int64_t ms) const;
  Result<void> remove(std::string_view id);
  /// Of each client's jobs that ended without a result only so many stay, the latest.
  Result<void> keep_latest(std::size_t most);
  /// Of all results, and of what the list says of jobs that have ended.
  Result<std::uint64_t> total_bytes() const;
  Result<std::uint64_t> bytes_of(std::string_view client) const;

 private:
  JobStore(Sqlite db, std::string path) : db_(std::move(db)), path_(std::move(path)) {}
  std::unexpected<Error> failed(const Error&) const;
  Result<std::vector<Job>> jobs(SqliteQuery&) const;
  Result<std::uint64_t> bytes(SqliteQuery&) const;

  Sqlite db_;
  std::string path_;
  bool is_new_ = false;
  std::uint64_t device_ = 0, inode_ = 0;  // of the file
  mutable std::mutex mutex_;
};

}  // namespace tind::services
