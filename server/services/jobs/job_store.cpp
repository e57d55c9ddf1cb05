#include "server/services/jobs/job_store.h"

#include <sys/stat.h>

#include <cerrno>
#include <utility>

#include "terrain/base/errno_text.h"

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
/// What has not ended has no results yet, and its orders may be long.
constexpr const char* kBytes =
    "SELECT coalesce(sum(bytes + length(work) + 512), 0) FROM job WHERE finished > 0";
/// `work`, `bytes`: those, or what stands in their place.
std::string columns(const char* work = "work", const char* bytes = "bytes") {
  return std::string("id, process, client, ") + work +
         ", status, message, progress, attempts, exit_code, " + bytes +
         ", created, started, finished, updated";
}

/// With what to do about it.
Error advised(Error error, const std::string& path) {
  if (error.code == Errc::bad_data) error.what += "; it is no list of jobs: move it away";
  if (error.code == Errc::busy)
    error.what = path + ": another daemon has it; give this one a folder of its own";
  return error;
}

Job job_of(const SqliteQuery& row) {
  Job j;
  j.id = row.text(0), j.process = row.text(1), j.client = row.text(2);
  if (std::string work = row.text(3); !work.empty())
    j.order = std::make_shared<const std::string>(std::move(work));
  j.status = JobStatus(row.integer(4)), j.message = row.text(5), j.progress = int(row.integer(6));
  j.attempts = int(row.integer(7)), j.exit_code = int(row.integer(8));
  j.bytes = std::uint64_t(row.integer(9));
  j.created_ms = row.integer(10), j.started_ms = row.integer(11), j.finished_ms = row.integer(12);
  j.updated_ms = row.integer(13);
  return j;
}

/// Whether it was new.
Result<bool> prepare(Sqlite& db, const std::string& path) {
  // Ours alone until it is closed: two daemons on one list would both do every job.
  if (auto done = db.run("PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = WAL;"
                         "PRAGMA synchronous = FULL; BEGIN IMMEDIATE;");
      !done)
    return std::unexpected(done.error());
  const auto version = db.number("PRAGMA user_version");
  const auto application = db.number("PRAGMA application_id");
  if (!version || !application) return std::unexpected(db.error());
  const bool is_new =
      *application == 0 && *version == 0 && db.number("SELECT count(*) FROM sqlite_master") == 0;
  if (is_new) {
    const std::string make = std::string(kMake) +
                             "PRAGMA application_id = " + std::to_string(kApplication) +
                             "; PRAGMA user_version = " + std::to_string(kSchema) + ";";
    if (auto done = db.run(make); !done) return std::unexpected(done.error());
  } else if (*application != kApplication || *version != kSchema) {
    return fail(Errc::bad_data,
                path + ": is a list of something else, or of another version of tind");
  }
  if (auto done = db.run("COMMIT;"); !done) return std::unexpected(done.error());
  return is_new;
}

}  // namespace

Result<std::unique_ptr<JobStore>> JobStore::open(const std::string& path) {
  auto db = Sqlite::open(path, Sqlite::Open::write);
  if (!db) return std::unexpected(advised(db.error(), path));
  std::unique_ptr<JobStore> store(new JobStore(std::move(*db), path));
  const auto is_new = prepare(store->db_, path);
  if (!is_new) return std::unexpected(advised(is_new.error(), path));
  store->is_new_ = *is_new;
  struct stat facts {};  // SQLite keeps its descriptor to itself
  if (::stat(path.c_str(), &facts) != 0) return fail(Errc::io, path + ": " + errno_text(errno));
  store->device_ = facts.st_dev, store->inode_ = facts.st_ino;
  return store;
}

std::expected<bool, int> JobStore::is_in_place() const {
  struct stat facts {};
  if (::stat(path_.c_str(), &facts) == 0) return facts.st_dev == device_ && facts.st_ino == inode_;
  if (errno == ENOENT) return false;
  return std::unexpected(errno);
}

std::unexpected<Error> JobStore::failed(const Error& error) const {
  return std::unexpected(advised(error, path_));
}

Result<void> JobStore::put(const Job& j) {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_,
                    "INSERT INTO job (" + columns() +
                        ") VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?) ON CONFLICT (id) DO UPDATE SET "
                        "work = CASE excluded.work WHEN '' THEN work ELSE excluded.work END, "
                        "status = excluded.status, message = excluded.message, "
                        "progress = excluded.progress, attempts = excluded.attempts, "
                        "exit_code = excluded.exit_code, bytes = excluded.bytes, "
                        "started = excluded.started, finished = excluded.finished, "
                        "updated = excluded.updated");
  query.bind(j.id).bind(j.process).bind(j.client).bind(j.order ? *j.order : "").bind(int(j.status));
  query.bind(j.message).bind(j.progress).bind(j.attempts).bind(j.exit_code);
  query.bind(std::int64_t(j.bytes)).bind(j.created_ms).bind(j.started_ms).bind(j.finished_ms);
  query.bind(j.updated_ms);
  if (auto done = query.run(); !done) return failed(done.error());
  return {};
}

Result<std::optional<Job>> JobStore::find(std::string_view id) const {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, "SELECT " + columns() + " FROM job WHERE id = ?");
  query.bind(id);
  const auto row = query.next();
  if (!row) return failed(row.error());
  return *row ? std::optional(job_of(query)) : std::nullopt;
}

Result<std::vector<Job>> JobStore::jobs(SqliteQuery& query) const {
  std::vector<Job> all;
  for (;;) {
    const auto row = query.next();
    if (!row) return failed(row.error());
    if (!*row) return all;
    all.push_back(job_of(query));
  }
}

Result<std::vector<Job>> JobStore::of_client(std::string_view client, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, "SELECT " + columns("NULL") +
                             " FROM job WHERE client = ? ORDER BY created DESC, id LIMIT ?");
  query.bind(client).bind(std::int64_t(most));
  return jobs(query);
}

Result<std::vector<Job>> JobStore::unfinished() const {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, "SELECT " + columns("NULL", "length(CAST(work AS BLOB))") +
                             " FROM job WHERE finished = 0 ORDER BY created, id");
  return jobs(query);
}

Result<std::vector<Job>> JobStore::finished_before(std::int64_t ms) const {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, "SELECT " + columns() +
                             " FROM job WHERE finished > 0 AND finished < ? ORDER BY finished");
  query.bind(ms);
  return jobs(query);
}

Result<void> JobStore::remove(std::string_view id) {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, "DELETE FROM job WHERE id = ?");
  query.bind(id);
  if (auto done = query.run(); !done) return failed(done.error());
  return {};
}

Result<void> JobStore::keep_latest(std::size_t most) {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_,
                    "DELETE FROM job WHERE id IN (SELECT id FROM (SELECT id, row_number() OVER "
                    "(PARTITION BY client ORDER BY created DESC, id) AS place FROM job "
                    "WHERE finished > 0 AND status <> ?) WHERE place > ?)");
  query.bind(int(JobStatus::successful)).bind(std::int64_t(most));
  if (auto done = query.run(); !done) return failed(done.error());
  return {};
}

Result<std::uint64_t> JobStore::bytes(SqliteQuery& query) const {
  if (const auto row = query.next(); !row) return failed(row.error());
  return std::uint64_t(query.integer(0));
}

Result<std::uint64_t> JobStore::total_bytes() const {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, kBytes);
  return bytes(query);
}

Result<std::uint64_t> JobStore::bytes_of(std::string_view client) const {
  const std::lock_guard lock(mutex_);
  SqliteQuery query(db_, std::string(kBytes) + " AND client = ?");
  query.bind(client);
  return bytes(query);
}

}  // namespace tind::services
