#include "terrain/base/sqlite.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/support.h"

namespace tind {
namespace {

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
