#pragma once
// A database in a file. The only user of SQLite.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "terrain/base/bytes.h"
#include "terrain/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace tind {

/// For one thread at a time.
class Sqlite {
 public:
  enum class Open {
    read,   // somebody else's, which is not trusted: its schema runs no functions, no query runs
            // long
    write,  // ours, made where it is not there
    alone,  // the same, of a file that nobody else opens: without locks
  };
  static Result<Sqlite> open(const std::string& path, Open);
  Sqlite(Sqlite&&) noexcept = default;
  Sqlite& operator=(Sqlite&&) noexcept = default;

  /// Statements without values.
  Result<void> run(const std::string& sql);
  /// The first number of the answer.
  Result<std::int64_t> number(const std::string& sql);

  /// What went wrong last. bad_data where the file is no database, or a damaged one; busy where
  /// another has it; else io.
  Error error() const;
  /// Was it that a stranger's query was given up?
  bool took_too_long() const;

 private:
  friend class SqliteQuery;
  struct Close {
    void operator()(sqlite3*) const;
  };
  Sqlite(sqlite3* db, std::string path) : db_(db), path_(std::move(path)) {}

  std::unique_ptr<sqlite3, Close> db_;
  std::string path_;
};

/// One statement with its values, once or, with again(), often. The database must outlive it.
class SqliteQuery {
 public:
  SqliteQuery(const Sqlite&, const std::string& sql);

  SqliteQuery& bind(std::string_view text);
  SqliteQuery& bind(std::int64_t value);
  SqliteQuery& bind_bytes(ByteView);
  /// Of a stranger's database: what one row may take, in millions of steps of SQLite's machine (a
  /// second has 50 to 100). Without it, a fraction of a minute.
  SqliteQuery& within(int million_steps) {
    most_looks_ = million_steps;
    return *this;
  }
  /// The next row: is there one?
  Result<bool> next();
  /// To its end; rows are passed over.
  Result<void> run();
  /// Without values, from the beginning.
  void again();

  // Of a row that there is.
  std::string text(int column) const;
  /// Valid until next() or again().
  std::string_view bytes(int column) const;
  std::int64_t integer(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt*) const;
  };
  const Sqlite& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  std::optional<Error> unprepared_;  // why there is no statement
  int bound_ = 0, most_looks_ = 1000;
};

}  // namespace tind
