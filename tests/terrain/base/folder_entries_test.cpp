#include "terrain/base/folder_entries.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

std::set<std::string> names(const std::vector<fs::directory_entry>& entries,
                            const fs::path& below) {
  std::set<std::string> all;
  for (const auto& entry : entries) all.insert(entry.path().lexically_relative(below).string());
  return all;
}

TEST(FolderEntries, AreThoseOfTheFolderOrOfAllBelow) {
  const test::TempDir dir;
  fs::create_directories(dir.file("a/b"));
  std::ofstream(dir.file("a/b/c")) << "";
  std::ofstream(dir.file(".hidden")) << "";
  fs::create_directory_symlink(dir.file("a"), dir.file("link"));
  const std::string folder = dir.file("");
  EXPECT_EQ(names(entries_of(folder).value(), folder),
            (std::set<std::string>{"a", ".hidden", "link"}));
  EXPECT_EQ(names(entries_below(folder).value(), folder),
            (std::set<std::string>{"a", "a/b", "a/b/c", ".hidden", "link"}));
}

TEST(FolderEntries, SayWhatCannotBeLookedInto) {
  const test::TempDir dir;
  const auto missing = entries_of(dir.file("missing"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, Errc::not_found);
  std::ofstream(dir.file("file")) << "";
  const auto file = entries_below(dir.file("file"));
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, Errc::io);
  EXPECT_NE(file.error().what.find("cannot look into " + dir.file("file")), std::string::npos);
}

}  // namespace
}  // namespace tind
