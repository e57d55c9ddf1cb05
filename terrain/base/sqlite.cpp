#include "terrain/base/sqlite.h"

#include <sqlite3.h>

#include <filesystem>
#include <utility>

#include "terrain/base/file_there.h"

namespace tind {

namespace {

constexpr int kLongestValue = 256 << 20;  // bytes of what a stranger's file may hold
constexpr int kStepsAtOnce = 1'000'000;   // of SQLite's machine, until somebody looks

/// Counts down what a query may take, and ends it.
int look(void* left) { return --*static_cast<int*>(left) < 0; }

void distrust(sqlite3* db) {
  sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_limit(db, SQLITE_LIMIT_LENGTH, kLongestValue);
}

/// The file alone. Without this a database in WAL mode is read through a file beside it that is
/// mapped into memory: who cuts that off ends the whole process (SIGBUS).
std::string immutable(const std::string& path) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string())
    uri += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
  return uri + "?immutable=1";
}

/// What a writer has beside the file is not read: while it is there, the file is not whole.
Result<void> nothing_pending(const std::string& path) {
  for (const char* const beside : {"-wal", "-journal"}) {
    const auto there = is_there(path + beside);
    if (!there) return std::unexpected(there.error());
    if (!*there) continue;
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path + beside, error);
    if (error && error != std::errc::no_such_file_or_directory)
      return fail(Errc::io, path + beside + ": " + error.message());
    if (!error && bytes > 0)
      return fail(Errc::busy,
                  path + beside +
                      ": a program has the database open for writing (QGIS does for as long as it "
                      "shows it): close it there; or it stopped in the middle: "
                      "opening it once with sqlite3 brings it to its end");
  }
  return {};
}

}  // namespace

void Sqlite::Close::operator()(sqlite3* db) const { sqlite3_close_v2(db); }
void SqliteQuery::Finalize::operator()(sqlite3_stmt* s) const { sqlite3_finalize(s); }

Result<Sqlite> Sqlite::open(const std::string& path, Open how) {
  if (how == Open::read)
    if (auto whole = nothing_pending(path); !whole) return std::unexpected(whole.error());
  sqlite3* db = nullptr;
  const int flags = how == Open::read ? SQLITE_OPEN_READONLY | SQLITE_OPEN_URI
                                      : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  const char* const files = how == Open::alone ? "unix-none" : nullptr;
  const std::string name = how == Open::read ? immutable(path) : path;
  const int code = sqlite3_open_v2(name.c_str(), &db, flags, files);
  Sqlite opened(db, path);
  if (code != SQLITE_OK) return std::unexpected(opened.error());
  if (how == Open::read) distrust(db);
  return opened;
}

Error Sqlite::error() const {
  const int code = sqlite3_errcode(db_.get());
  const std::string what = path_ + ": " + sqlite3_errmsg(db_.get());
  if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) return {Errc::bad_data, what};
  if (code == SQLITE_INTERRUPT)
    return {Errc::io, path_ +
                          ": a query takes too long: its tables are views without "
                          "end, or have no index"};
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED) return {Errc::busy, what};
  return {Errc::io, what};
}

bool Sqlite::took_too_long() const { return sqlite3_errcode(db_.get()) == SQLITE_INTERRUPT; }

Result<void> Sqlite::run(const std::string& sql) {
  if (sqlite3_exec(db_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return std::unexpected(error());
}

Result<std::int64_t> Sqlite::number(const std::string& sql) {
  SqliteQuery query(*this, sql);
  const auto row = query.next();
  if (!row) return std::unexpected(row.error());
  if (!*row) return fail(Errc::bad_data, path_ + ": no answer to " + sql);
  return query.integer(0);
}

SqliteQuery::SqliteQuery(const Sqlite& database, const std::string& sql) : database_(database) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database.db_.get(), sql.c_str(), -1, &statement, nullptr);
  statement_.reset(statement);
  if (!statement) unprepared_ = database.error();
}

SqliteQuery& SqliteQuery::bind(std::string_view text) {
  if (statement_)
    sqlite3_bind_text(statement_.get(), ++bound_, text.data(), int(text.size()), SQLITE_TRANSIENT);
  return *this;
}

SqliteQuery& SqliteQuery::bind(std::int64_t value) {
  if (statement_) sqlite3_bind_int64(statement_.get(), ++bound_, value);
  return *this;
}

SqliteQuery& SqliteQuery::bind_bytes(ByteView bytes) {
  if (statement_)
    sqlite3_bind_blob64(statement_.get(), ++bound_, bytes.data, bytes.size, SQLITE_TRANSIENT);
  return *this;
}

Result<bool> SqliteQuery::next() {
  if (unprepared_) return std::unexpected(*unprepared_);
  int looks = most_looks_;
  const bool strangers = sqlite3_db_readonly(database_.db_.get(), "main") == 1;
  if (strangers) sqlite3_progress_handler(database_.db_.get(), kStepsAtOnce, look, &looks);
  const int step = sqlite3_step(statement_.get());
  if (strangers) sqlite3_progress_handler(database_.db_.get(), 0, nullptr, nullptr);
  if (step == SQLITE_ROW) return true;
  if (step == SQLITE_DONE) return false;
  return std::unexpected(database_.error());
}

Result<void> SqliteQuery::run() {
  for (;;) {
    const auto row = next();
    if (!row) return std::unexpected(row.error());
    if (!*row) return {};
  }
}

void SqliteQuery::again() {
  if (!statement_) return;
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
  bound_ = 0;
}

std::string SqliteQuery::text(int column) const {
  const auto* const text = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text ? std::string(reinterpret_cast<const char*>(text), std::size_t(size)) : std::string();
}

std::string_view SqliteQuery::bytes(int column) const {
  const auto* const bytes = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes ? std::string_view(static_cast<const char*>(bytes), std::size_t(size))
               : std::string_view();
}

std::int64_t SqliteQuery::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

}  // namespace tind
