#pragma once
// The jobs of a daemon in a file, so that a restart knows them all. The only user of SQLite.

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/services/jobs/job.h"
#include "terrain/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace tind::services {

/// Thread-safe. What has been put is there after a power cut.
class JobStore {
 public:
  /// Opens or makes the file. Fails (io), naming it, where it cannot, (bad_data) where it is of
  /// something else, (busy) where another daemon has it.
  static Result<std::unique_ptr<JobStore>> open(const std::string& path);
  ~JobStore();
  JobStore(const JobStore&) = delete;
  JobStore& operator=(const JobStore&) = delete;

  /// A new one, or in place of the one with its id.
  Result<void> put(const Job&);
  Result<std::optional<Job>> find(std::string_view id) const;
  /// The latest first.
  Result<std::vector<Job>> of_client(std::string_view client, std::size_t most) const;
  /// The oldest first.
  Result<std::vector<Job>> unfinished() const;
  Result<std::vector<Job>> finished_before(std::int64_t ms) const;
  Result<void> remove(std::string_view id);
  /// Of all that there is.
  Result<std::uint64_t> total_bytes() const;

 private:
  explicit JobStore(sqlite3* db, std::string path) : db_(db), path_(std::move(path)) {}
  class Query;
  std::unexpected<Error> failed() const;
  Result<std::vector<Job>> jobs(Query&) const;

  sqlite3* db_;
  std::string path_;
  mutable std::mutex mutex_;
};

}  // namespace tind::services
