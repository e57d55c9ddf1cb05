// A .3tz: of finished folders only, the same for any number of threads, whole or not there.

#include "terrain/tiles3d/tileset_archive.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stop_token>

#include "terrain/base/file_io.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/part_file.h"
#include "terrain/tiles3d/tileset.h"
#include "tests/support/support.h"

namespace tind::tiles3d {
namespace {

namespace fs = std::filesystem;

/// All tiles of the first levels.
class Levels : public TileSet {
 public:
  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return id.level <= kLast; }
  Result<TileBytes> tile(TileId, std::stop_token) const override {
    return fail(Errc::internal, "asked for");
  }
  static constexpr int kLast = 4;
  static constexpr std::uint64_t kContents = 2 * (1 + 4 + 16 + 64 + 256), kSubtrees = 2 * (1 + 64);

 private:
  proto::LayerJson layer_ = [] {
    proto::LayerJson layer;
    layer.maxzoom = kLast;
    return layer;
  }();
};

class Archive : public ::testing::Test {
 protected:
  void put(const std::string& name, const std::string& bytes) {
    const fs::path path = fs::path(folder_) / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
  }
  Archive() {
    std::size_t i = 0;
    each_tile(set_, [&](TileId id) {
      put(path_of(id) + ".glb", std::string(i, 'x') + std::to_string(i * 7919));
      ++i;
      if (id.level % kSubtreeLevels == 0) put(path_of(id) + ".subtree", "subtree");
    });
    put("tind-3dtiles.json", "ours");
    put("east/3/1.glb.part", "half");
  }

  const Levels set_;
  test::TempDir dir_;
  const std::string folder_ = dir_.file("3dtiles"), file_ = dir_.file("a.3tz");
};

TEST_F(Archive, IsTheSameForAnyNumberOfThreadsAndLeavesOutWhatTheSetDoesNotName) {
  put("tileset.json", "{}");
  ASSERT_TRUE(write_archive(set_, folder_, dir_.file("b.3tz"), 5));
  for (const char* name : {"east/mine.glb", "west/0/0/1.glb", "west/5/0/0.glb",
                           "west/1/0/0.subtree", "west/3/0/0.txt", "mine.subtree"})
    put(name, "mine");
  const auto one = write_archive(set_, folder_, file_, 1);
  ASSERT_TRUE(one) << one.error().what;
  EXPECT_EQ(one->files, 1 + Levels::kContents + Levels::kSubtrees);
  EXPECT_EQ(one->bytes, fs::file_size(file_));
  const std::string bytes = *read_whole_file(file_);
  EXPECT_EQ(bytes.find("tind-3dtiles"), bytes.npos);
  EXPECT_EQ(bytes.find(".part"), bytes.npos);
  EXPECT_EQ(*read_whole_file(dir_.file("b.3tz")), bytes);
}

TEST_F(Archive, WithoutAFileOfTheSetIsNone) {
  put("tileset.json", "{}");
  fs::remove(fs::path(folder_) / "east/3/1/2.glb");
  EXPECT_FALSE(write_archive(set_, folder_, file_));
  EXPECT_FALSE(fs::exists(file_));
}

TEST_F(Archive, WhatIsNotFinishedIsRefused) {
  const auto refused = write_archive(set_, folder_, file_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  put("tileset.json", "{}");
  const auto lock = FolderLock::take(folder_);
  ASSERT_TRUE(lock);
  const auto busy = write_archive(set_, folder_, file_);
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error().code, Errc::busy);
  EXPECT_FALSE(fs::exists(file_));
}

TEST_F(Archive, WhatFailsLeavesWhatWasThere) {
  put("tileset.json", "{}");
  std::ofstream(file_) << "of before";
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = write_archive(set_, folder_, file_, 1, {{}, stop.get_token()});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  fs::remove(fs::path(folder_) / "east/3/1/2.glb");
  fs::create_directory(fs::path(folder_) / "east/3/1/2.glb");  // cannot be read
  EXPECT_FALSE(write_archive(set_, folder_, file_));
  EXPECT_EQ(*read_whole_file(file_), "of before");
  EXPECT_FALSE(fs::exists(file_ + ".tind-part"));
}

TEST_F(Archive, IsWrittenByOneAtATimeAndOverNobodysFile) {
  put("tileset.json", "{}");
  const std::string part = file_ + ".tind-part", victim = file_ + ".victim";
  {
    const auto other = PartFile::begin(file_, "PK\3\4");
    ASSERT_TRUE(other);
    EXPECT_EQ(write_archive(set_, folder_, file_).error().code, Errc::busy);
  }
  std::ofstream(part) << "precious";
  EXPECT_EQ(write_archive(set_, folder_, file_).error().code, Errc::invalid_argument);
  EXPECT_EQ(*read_whole_file(part), "precious");
  fs::remove(part);
  std::ofstream(victim) << "precious";
  fs::create_symlink(victim, part);
  EXPECT_EQ(write_archive(set_, folder_, file_).error().code, Errc::invalid_argument);
  EXPECT_EQ(*read_whole_file(victim), "precious");
  fs::remove(part);
  fs::create_symlink(victim, file_);  // a link stays one
  EXPECT_TRUE(write_archive(set_, folder_, file_));
  EXPECT_TRUE(fs::is_symlink(file_));
  EXPECT_TRUE(read_whole_file(victim)->starts_with("PK"));
}

}  // namespace
}  // namespace tind::tiles3d
