// A .3tz: of finished folders only, the same for any number of threads, whole or not there.

#include "terrain/tiles3d/tileset_archive.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stop_token>

#include "terrain/base/file_io.h"
#include "terrain/store/folder/folder_lock.h"
#include "tests/support/support.h"

namespace tind::tiles3d {
namespace {

namespace fs = std::filesystem;

class Archive : public ::testing::Test {
 protected:
  void put(const std::string& name, const std::string& bytes) {
    const fs::path path = fs::path(folder_) / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
  }
  Archive() {
    for (int i = 0; i < 700; ++i)
      put((i % 2 ? "east/3/" : "west/3/") + std::to_string(i) + ".glb",
          std::string(std::size_t(i), 'x') + std::to_string(i * 7919));
    put("east/0/0/0.subtree", "subtree");
    put("tind-3dtiles.json", "ours");
    put("east/3/1.glb.part", "half");
  }

  test::TempDir dir_;
  const std::string folder_ = dir_.file("3dtiles"), file_ = dir_.file("a.3tz");
};

TEST_F(Archive, IsTheSameForAnyNumberOfThreadsAndLeavesOutWhatIsNoTile) {
  put("tileset.json", "{}");
  const auto one = write_archive(folder_, file_, 1);
  ASSERT_TRUE(one) << one.error().what;
  EXPECT_EQ(one->files, 702u);
  EXPECT_EQ(one->bytes, fs::file_size(file_));
  const std::string bytes = *read_whole_file(file_);
  EXPECT_EQ(bytes.find("tind-3dtiles"), bytes.npos);
  EXPECT_EQ(bytes.find(".part"), bytes.npos);
  ASSERT_TRUE(write_archive(folder_, dir_.file("b.3tz"), 5));
  EXPECT_EQ(*read_whole_file(dir_.file("b.3tz")), bytes);
}

TEST_F(Archive, WhatIsNotFinishedIsRefused) {
  const auto refused = write_archive(folder_, file_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  put("tileset.json", "{}");
  const auto lock = FolderLock::take(folder_);
  ASSERT_TRUE(lock);
  const auto busy = write_archive(folder_, file_);
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error().code, Errc::busy);
  EXPECT_FALSE(fs::exists(file_));
}

TEST_F(Archive, WhatFailsLeavesWhatWasThere) {
  put("tileset.json", "{}");
  std::ofstream(file_) << "of before";
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = write_archive(folder_, file_, 1, {{}, stop.get_token()});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  fs::remove(fs::path(folder_) / "east/3/1.glb");
  fs::create_directory(fs::path(folder_) / "east/3/1.glb");  // cannot be read
  EXPECT_FALSE(write_archive(folder_, file_));
  EXPECT_EQ(*read_whole_file(file_), "of before");
  EXPECT_FALSE(fs::exists(file_ + ".part"));
}

}  // namespace
}  // namespace tind::tiles3d
