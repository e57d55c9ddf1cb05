#include "terrain/base/same_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "terrain/base/descriptor.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(IsStillAt, KnowsAFileByWhatItIsAndNotByItsName) {
  const test::TempDir dir;
  const std::string path = dir.file("a");
  std::ofstream(path) << "text";
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  EXPECT_EQ(is_still_at(file.get(), path).value(), true);
  std::filesystem::rename(path, dir.file("b"));
  EXPECT_EQ(is_still_at(file.get(), path).value(), false) << "nothing is there";
  std::ofstream(path) << "text";
  EXPECT_EQ(is_still_at(file.get(), path).value(), false) << "another file is";
  std::filesystem::remove(path);
  std::filesystem::create_symlink(dir.file("b"), path);
  EXPECT_EQ(is_still_at(file.get(), path).value(), false) << "a link to it is not it";
  EXPECT_EQ(is_still_at(file.get(), dir.file("b")).value(), true);
}

TEST(IsStillAt, IsNoMoreThanAnErrorWhereTheSystemDoesNotSay) {
  const test::TempDir dir;
  const std::string path = dir.file("a");
  std::ofstream(path) << "text";
  const auto closed = is_still_at(-1, path);
  ASSERT_FALSE(closed);
  EXPECT_EQ(closed.error().code, Errc::io);
  EXPECT_NE(closed.error().what.find(path), std::string::npos) << closed.error().what;
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  EXPECT_FALSE(is_still_at(file.get(), path + "/below"));
}

}  // namespace
}  // namespace tind
