#include "terrain/base/file_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <iterator>

#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::ptrdiff_t files_in(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

TEST(FileIo, a_process_that_is_killed_while_it_writes_leaves_nothing_behind) {
  const tind::test::TempDir dir;
  ASSERT_TRUE(write_whole_file(dir.file("a"), "old"));
  const std::string bytes(1 << 20, 'x');
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_DFL);
    const rlimit no_core{0, 0}, small{20000, 20000};  // the write that goes beyond it kills
    setrlimit(RLIMIT_CORE, &no_core);
    setrlimit(RLIMIT_FSIZE, &small);
    (void)write_whole_file(dir.file("a"), bytes);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ);
  EXPECT_EQ(read_whole_file(dir.file("a")).value(), "old");
  EXPECT_EQ(files_in(dir.path()), 1);
}

TEST(FileIo, a_link_stays_a_link_and_permissions_are_those_of_a_new_file) {
  const tind::test::TempDir dir;
  ASSERT_TRUE(write_whole_file(dir.file("a"), "old"));
  fs::create_symlink("a", dir.path() / "b");
  ASSERT_TRUE(write_whole_file(dir.file("b"), "new"));
  EXPECT_TRUE(fs::is_symlink(dir.path() / "b"));
  EXPECT_EQ(read_whole_file(dir.file("a")).value(), "new");
  fs::create_symlink("c", dir.path() / "d");
  EXPECT_TRUE(can_write_file(dir.file("d")));
  ASSERT_TRUE(write_whole_file(dir.file("d"), "first"));
  EXPECT_TRUE(fs::is_symlink(dir.path() / "d"));
  EXPECT_EQ(read_whole_file(dir.file("c")).value(), "first");
  const mode_t mask = ::umask(0);
  ::umask(mask);
  EXPECT_EQ(unsigned(fs::status(dir.path() / "a").permissions()), 0666u & ~mask);
}

TEST(FileIo, what_cannot_be_opened_is_not_what_is_not_there) {
  const tind::test::TempDir dir;
  EXPECT_EQ(read_regular_file(dir.file("none")).error().code, Errc::not_found);
  ASSERT_TRUE(write_whole_file(dir.file("file"), ""));
  EXPECT_EQ(read_whole_file(dir.file("file/below")).error().code, Errc::not_found);
  fs::create_symlink(dir.file("circle"), dir.file("circle"));
  EXPECT_EQ(read_regular_file(dir.file("circle")).error().code, Errc::io);
}

TEST(FileIo, whether_a_file_can_be_written_is_known_beforehand) {
  const tind::test::TempDir dir;
  EXPECT_TRUE(can_write_file(dir.file("new")));
  EXPECT_FALSE(fs::exists(dir.path() / "new"));
  ASSERT_TRUE(write_whole_file(dir.file("old"), "old"));
  EXPECT_TRUE(can_write_file(dir.file("old")));
  EXPECT_EQ(read_whole_file(dir.file("old")).value(), "old");
  EXPECT_TRUE(can_write_file("/dev/null"));
  EXPECT_THAT(can_write_file(dir.file("no/such/folder")).error().what, HasSubstr("No such file"));
  EXPECT_THAT(can_write_file(dir.path().string()).error().what, HasSubstr("Is a directory"));
  EXPECT_THAT(can_write_file(dir.file("old/below")).error().what, HasSubstr("Not a directory"));
  EXPECT_THAT(can_write_file(dir.file(std::string(256, 'n'))).error().what,
              HasSubstr("File name too long"));
  EXPECT_EQ(files_in(dir.path()), 1);
}

TEST(FileIo, the_longest_name_there_can_be_is_written) {
  const tind::test::TempDir dir;
  const std::string path = dir.file(std::string(255, 'n'));
  for (const char* const text : {"once", "twice"}) {
    ASSERT_TRUE(write_whole_file(path, text));
    EXPECT_EQ(read_whole_file(path).value_or(""), text);
  }
  EXPECT_EQ(files_in(dir.path()), 1);
  // Of one who was killed, where the system has no files without names.
  ASSERT_TRUE(write_whole_file(dir.file(std::string(230, 'n') + ".partial-0123456789abcdef"), ""));
  ASSERT_TRUE(write_whole_file(dir.file("n.partial-0123456789abcdef"), ""));
  ASSERT_TRUE(remove_partials_of(path));
  EXPECT_EQ(files_in(dir.path()), 2) << "another's stays";
}

}  // namespace
}  // namespace tind
