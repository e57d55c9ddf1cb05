#include "server/services/jobs/job_store.h"

#include <sqlite3.h>

#include <utility>

namespace tind::services {
namespace {

constexpr int kSchema = 1;                // in user_version
constexpr int kApplication = 0x74696e64;  // "tind", in application_id

constexpr const char* kMake =
    "CREATE TABLE job ("
    " id TEXT PRIMARY KEY, process TEXT NOT NULL, client TEXT NOT NULL, work TEXT NOT NULL,"
    " status INTEGER NOT NULL, message TEXT NOT NULL, progress INTEGER NOT NULL,"
    " attempts INTEGER NOT NULL, exit_code INTEGER NOT NULL, bytes INTEGER NOT NULL,"
    " created INTEGER NOT NULL, started INTEGER NOT NULL, finished INTEGER NOT NULL,"
    " updated INTEGER NOT NULL) WITHOUT ROWID;"
    "CREATE INDEX job_client ON job (client, created);"
    "CREATE INDEX job_finished ON job (finished);";
constexpr const char* kColumns =
    "id, process, client, work, status, message, progress, attempts, exit_code, bytes, created, "
    "started, finished, updated";

Error error_of(sqlite3* db, const std::string& path) {
  const int code = sqlite3_errcode(db);
  const std::string what = path + ": " + sqlite3_errmsg(db);
  if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT)
    return {Errc::bad_data, what + "; it is no list of jobs: move it away"};
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED)
    return {Errc::busy, path + ": another daemon has it; give this one a folder of its own"};
  return {Errc::io, what};
}

bool run(sqlite3* db, const std::string& sql) {
  return sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
}

int number(sqlite3* db, const char* pragma) {
  int value = -1;
  sqlite3_exec(
      db, pragma,
      [](void* to, int, char** columns, char**) {
        *static_cast<int*>(to) = columns[0] ? std::atoi(columns[0]) : -1;
        return 0;
      },
      &value, nullptr);
  return value;
}

}  // namespace

/// One statement with its values; for one use.
class JobStore::Query {
 public:
  Query(const JobStore& store, const std::string& sql) {
    if (sqlite3_prepare_v2(store.db_, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK)
      statement_ = nullptr;
  }
  ~Query() { sqlite3_finalize(statement_); }
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  Query& bind(std::string_view text) {
    sqlite3_bind_text(statement_, ++bound_, text.data(), int(text.size()), SQLITE_TRANSIENT);
    return *this;
  }
  Query& bind(std::int64_t value) {
    sqlite3_bind_int64(statement_, ++bound_, value);
    return *this;
  }
  /// SQLITE_ROW, SQLITE_DONE, or an error.
  int step() { return statement_ ? sqlite3_step(statement_) : SQLITE_ERROR; }

  std::string text(int column) const {
    const auto* const bytes = sqlite3_column_text(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return bytes ? std::string(reinterpret_cast<const char*>(bytes), std::size_t(size)) : "";
  }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }

  Job job() const {
    Job j;
    j.id = text(0), j.process = text(1), j.client = text(2), j.order = text(3);
    j.status = JobStatus(integer(4)), j.message = text(5), j.progress = int(integer(6));
    j.attempts = int(integer(7)), j.exit_code = int(integer(8));
    j.bytes = std::uint64_t(integer(9));
    j.created_ms = integer(10), j.started_ms = integer(11), j.finished_ms = integer(12);
    j.updated_ms = integer(13);
    return j;
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

Result<std::unique_ptr<JobStore>> JobStore::open(const std::string& path) {
  sqlite3* db = nullptr;
  const int opened =
      sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  std::unique_ptr<JobStore> store(new JobStore(db, path));
  if (opened != SQLITE_OK) return std::unexpected(error_of(db, path));
  // Ours alone until it is closed: two daemons on one list would both do every job.
  const bool ready = run(db,
                         "PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = WAL;"
                         "PRAGMA synchronous = FULL; BEGIN IMMEDIATE;");
  if (!ready) return std::unexpected(error_of(db, path));
  const int version = number(db, "PRAGMA user_version");
  const int application = number(db, "PRAGMA application_id");
  if (application == 0 && version == 0 && number(db, "SELECT count(*) FROM sqlite_master") == 0) {
    const std::string make = std::string(kMake) +
                             "PRAGMA application_id = " + std::to_string(kApplication) +
                             "; PRAGMA user_version = " + std::to_string(kSchema) + ";";
    if (!run(db, make)) return std::unexpected(error_of(db, path));
  } else if (application != kApplication || version != kSchema) {
    return fail(Errc::bad_data, path +
                                    ": is no list of jobs, or one of another version of tind: "
                                    "move it away");
  }
  if (!run(db, "COMMIT;")) return std::unexpected(error_of(db, path));
  return store;
}

JobStore::~JobStore() { sqlite3_close(db_); }

std::unexpected<Error> JobStore::failed() const { return std::unexpected(error_of(db_, path_)); }

Result<void> JobStore::put(const Job& j) {
  const std::lock_guard lock(mutex_);
  Query query(*this, std::string("INSERT OR REPLACE INTO job (") + kColumns +
                         ") VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  query.bind(j.id).bind(j.process).bind(j.client).bind(j.order).bind(int(j.status));
  query.bind(j.message).bind(j.progress).bind(j.attempts).bind(j.exit_code);
  query.bind(std::int64_t(j.bytes)).bind(j.created_ms).bind(j.started_ms).bind(j.finished_ms);
  query.bind(j.updated_ms);
  if (query.step() != SQLITE_DONE) return failed();
  return {};
}

Result<std::optional<Job>> JobStore::find(std::string_view id) const {
  const std::lock_guard lock(mutex_);
  Query query(*this, std::string("SELECT ") + kColumns + " FROM job WHERE id = ?");
  query.bind(id);
  const int step = query.step();
  if (step == SQLITE_ROW) return std::optional(query.job());
  if (step != SQLITE_DONE) return failed();
  return std::optional<Job>();
}

Result<std::vector<Job>> JobStore::jobs(Query& query) const {
  std::vector<Job> all;
  int step = query.step();
  for (; step == SQLITE_ROW; step = query.step()) all.push_back(query.job());
  if (step != SQLITE_DONE) return failed();
  return all;
}

Result<std::vector<Job>> JobStore::of_client(std::string_view client, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  Query query(*this, std::string("SELECT ") + kColumns +
                         " FROM job WHERE client = ? ORDER BY created DESC, id LIMIT ?");
  query.bind(client).bind(std::int64_t(most));
  return jobs(query);
}

Result<std::vector<Job>> JobStore::unfinished() const {
  const std::lock_guard lock(mutex_);
  Query query(*this, std::string("SELECT ") + kColumns +
                         " FROM job WHERE finished = 0 ORDER BY created, id");
  return jobs(query);
}

Result<std::vector<Job>> JobStore::finished_before(std::int64_t ms) const {
  const std::lock_guard lock(mutex_);
  Query query(*this, std::string("SELECT ") + kColumns +
                         " FROM job WHERE finished > 0 AND finished < ? ORDER BY finished");
  query.bind(ms);
  return jobs(query);
}

Result<void> JobStore::remove(std::string_view id) {
  const std::lock_guard lock(mutex_);
  Query query(*this, "DELETE FROM job WHERE id = ?");
  query.bind(id);
  if (query.step() != SQLITE_DONE) return failed();
  return {};
}

Result<std::uint64_t> JobStore::total_bytes() const {
  const std::lock_guard lock(mutex_);
  Query query(*this, "SELECT coalesce(sum(bytes), 0) FROM job");
  if (query.step() != SQLITE_ROW) return failed();
  return std::uint64_t(query.integer(0));
}

}  // namespace tind::services
