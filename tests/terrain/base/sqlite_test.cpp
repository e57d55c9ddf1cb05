// Databases of ours and of strangers.

#include "terrain/base/sqlite.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/support.h"

namespace tind {
namespace {

TEST(Sqlite, WhatIsPutIsFound) {
  test::TempDir folder;
  const std::string path = folder.file("a.db");
  {
    auto db = Sqlite::open(path, Sqlite::Open::write);
    ASSERT_TRUE(db);
    ASSERT_TRUE(db->run("CREATE TABLE t (a INTEGER, b TEXT, c BLOB)"));
    SqliteQuery put(*db, "INSERT INTO t VALUES (?,?,?)");
    for (std::int64_t k = 0; k < 3; ++k) {
      put.again();
      ASSERT_TRUE(put.bind(k << 40).bind("text").bind_bytes(std::string(2, '\0')).run());
    }
  }
  auto db = Sqlite::open(path, Sqlite::Open::read);
  ASSERT_TRUE(db);
  EXPECT_EQ(db->number("SELECT count(*) FROM t"), 3);
  SqliteQuery get(*db, "SELECT a, b, c FROM t WHERE a > ? ORDER BY a");
  get.bind(std::int64_t(1));
  ASSERT_EQ(get.next(), true);
  EXPECT_EQ(get.integer(0), std::int64_t(1) << 40);
  EXPECT_EQ(get.text(1), "text");
  EXPECT_EQ(get.bytes(2), std::string_view("\0\0", 2));
  ASSERT_EQ(get.next(), true);
  ASSERT_EQ(get.next(), false);
}

TEST(Sqlite, WhatIsNotThereOrNoDatabaseIsAnError) {
  test::TempDir folder;
  EXPECT_EQ(Sqlite::open(folder.file("none"), Sqlite::Open::read).error().code, Errc::io);
  std::ofstream(folder.file("text")) << std::string(5000, 'x');
  auto text = Sqlite::open(folder.file("text"), Sqlite::Open::read);
  ASSERT_TRUE(text);  // read when it is asked
  EXPECT_EQ(text->number("SELECT 1 FROM t").error().code, Errc::bad_data);
  auto ours = Sqlite::open(folder.file("a.db"), Sqlite::Open::write);
  SqliteQuery query(*ours, "SELECT a FROM nothing");
  query.again();
  query.bind("x").bind(std::int64_t(1)).bind_bytes(std::string("y"));
  ASSERT_FALSE(query.next());
  EXPECT_NE(query.next().error().what.find("nothing"), std::string::npos);
}

TEST(Sqlite, AStrangersFileIsNotWrittenToAndRunsNothing) {
  test::TempDir folder;
  const std::string path = folder.file("a.db");
  ASSERT_TRUE(Sqlite::open(path, Sqlite::Open::write)
                  ->run("CREATE TABLE t (a); CREATE VIEW v AS SELECT load_extension('x') AS a"));
  auto db = Sqlite::open(path, Sqlite::Open::read);
  EXPECT_FALSE(db->run("INSERT INTO t VALUES (1)"));
  EXPECT_FALSE(db->number("SELECT a FROM v"));
}

std::string table_in(const test::TempDir& folder, const std::string& name) {
  const std::string path = folder.file(name);
  auto made = Sqlite::open(path, Sqlite::Open::write);
  EXPECT_TRUE(made && made->run("CREATE TABLE t (n); INSERT INTO t VALUES (7);"));
  return path;
}

TEST(Sqlite, AStrangersFileIsReadWithoutWhatLiesBesideIt) {
  const test::TempDir folder;
  for (const char* name : {"plain.db", "a b.db", "50%25?x#y.db"}) {
    const std::string path = table_in(folder, name);
    ASSERT_TRUE(Sqlite::open(path, Sqlite::Open::write)->run("PRAGMA journal_mode = WAL;"));
    auto read = Sqlite::open(path, Sqlite::Open::read);
    ASSERT_TRUE(read) << read.error().what;
    EXPECT_EQ(*read->number("SELECT n FROM t"), 7) << name;
    EXPECT_FALSE(std::filesystem::exists(path + "-shm")) << "nothing to be mapped";
    EXPECT_FALSE(read->run("INSERT INTO t VALUES (8);"));
  }
}

TEST(Sqlite, AFileThatSomebodyWritesToIsNotTakenForWhole) {
  const test::TempDir folder;
  for (const char* beside : {"-wal", "-journal"}) {
    const std::string path = table_in(folder, std::string("t") + beside + ".db");
    std::ofstream(path + beside) << "pending";
    const auto read = Sqlite::open(path, Sqlite::Open::read);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, Errc::busy);
    EXPECT_NE(read.error().what.find(beside), std::string::npos);
    std::ofstream(path + beside, std::ios::trunc);
    EXPECT_TRUE(Sqlite::open(path, Sqlite::Open::read)) << "an empty one says nothing";
  }
}

}  // namespace
}  // namespace tind
