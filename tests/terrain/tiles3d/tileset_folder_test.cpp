// 3D Tiles as files: the bytes of on demand; never another's files, never a part taken for whole.

#include "terrain/tiles3d/tileset_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "terrain/base/file_io.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/tiles3d/tileset.h"
#include "tests/support/made_up_source.h"

namespace tind::tiles3d {
namespace {

namespace fs = std::filesystem;

class Folder : public ::testing::Test {
 protected:
  static std::unique_ptr<DemTiles> open(const DemSource& source, int last_level = -1) {
    TileSetOptions options;
    options.effort = Effort::fast;
    options.last_level = last_level;
    auto opened = open_dem_tiles(source, options);
    EXPECT_TRUE(opened) << opened.error().what;
    return std::move(*opened);
  }
  std::set<std::string> files() const {
    std::set<std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file()) all.insert(entry.path().lexically_relative(folder_).string());
    return all;
  }

  test::MadeUpSource source_{test::rough_terrain(120, 100, 5), {7.1, 45.9}, 4e-4};
  std::unique_ptr<DemTiles> tiles_ = open(source_);
  test::TempDir dir_;
  const std::string folder_ = dir_.file("3dtiles");
};

TEST_F(Folder, HoldsTheBytesOfOnDemandAndNothingElse) {
  const auto report = write_tileset(*tiles_, folder_, {.threads = 2});
  ASSERT_TRUE(report) << report.error().what;
  const Source source{*tiles_,
                      [&](TileId id) { return decode_tile(id, tiles_->tile(id, {})->bytes); }};
  std::uint64_t contents = 0, subtrees = 0;
  for (const std::string& name : files()) {
    const auto bytes = read_whole_file(folder_ + "/" + name);
    ASSERT_TRUE(bytes);
    const std::vector<std::uint8_t> there(bytes->begin(), bytes->end());
    int z = 0, x = 0, y = 0;
    char suffix[16] = "";
    if (std::sscanf(name.c_str(), "%*4s/%d/%d/%d.%15s", &z, &x, &y, suffix) != 4) {
      EXPECT_TRUE(name == "tileset.json" || name == "tind-3dtiles.json" ||
                  name == "tind-3dtiles-done")
          << name;
      continue;
    }
    const auto id = tile_at(name.substr(0, 4), z, x, y);
    ASSERT_TRUE(id) << name;
    const bool content_file = std::string(suffix) == "glb";
    EXPECT_EQ(*(content_file ? content(source, *id) : subtree(source, *id)), there) << name;
    ++(content_file ? contents : subtrees);
  }
  EXPECT_EQ(*read_whole_file(folder_ + "/tileset.json"), *tileset_json(source));
  EXPECT_EQ(report->contents, contents);
  EXPECT_EQ(report->subtrees, subtrees);
  EXPECT_GT(contents, 25u);
}

TEST_F(Folder, OfCompressedContentsHasThoseOfOnDemandToo) {
  const auto report = write_tileset(*tiles_, folder_, {.compression = GlbCompression::meshopt});
  ASSERT_TRUE(report) << report.error().what;
  const Source source{*tiles_,
                      [&](TileId id) { return decode_tile(id, tiles_->tile(id, {})->bytes); },
                      GlbCompression::meshopt};
  for (const TileId id : {TileId{0, 0, 0}, TileId{0, 1, 0}}) {
    const auto bytes = read_whole_file(folder_ + "/" + path_of(id) + ".glb");
    ASSERT_TRUE(bytes);
    EXPECT_EQ(*content(source, id), std::vector<std::uint8_t>(bytes->begin(), bytes->end()));
  }
}

TEST_F(Folder, IsLeftAsItIsWhereItIsOfTheseTiles) {
  ASSERT_TRUE(write_tileset(*tiles_, folder_));
  const std::string some = folder_ + "/east/0/0/0.glb";
  std::string bytes = *read_whole_file(some);
  bytes.back() = char(bytes.back() ^ 1);  // to see whether it is written
  std::ofstream(some, std::ios::trunc) << bytes;
  const auto again = write_tileset(*tiles_, folder_);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->there);
  EXPECT_EQ(*read_whole_file(some), bytes);
}

TEST_F(Folder, WhatIsGoneOrCutOffOfAFinishedOneIsMadeAgain) {
  const auto whole = write_tileset(*tiles_, folder_);
  ASSERT_TRUE(whole);
  const std::string leaf = [&] {  // a content of the deepest level
    std::string deepest;
    each_tile(*tiles_, [&](TileId id) {
      if (id.level == tiles_->layer().maxzoom) deepest = path_of(id);
    });
    return deepest + ".glb";
  }();
  std::map<std::string, std::string> before;
  for (const std::string& name : files()) before[name] = *read_whole_file(folder_ + "/" + name);
  const auto damage = [&](const std::string& name, std::size_t left) {
    std::ofstream(folder_ + "/" + name, std::ios::trunc) << before[name].substr(0, left);
  };
  for (const std::string& name : {leaf, std::string("east/0/0/0.subtree")}) {
    for (const std::size_t left : {std::size_t(0), std::size_t(30), before[name].size() - 1}) {
      damage(name, left);
      const auto again = write_tileset(*tiles_, folder_);
      ASSERT_TRUE(again) << again.error().what;
      EXPECT_FALSE(again->there) << name << ' ' << left;
      EXPECT_EQ(again->subtrees, 1u);
      EXPECT_EQ(again->kept_subtrees, whole->subtrees - 1);
      EXPECT_EQ(*read_whole_file(folder_ + "/" + name), before[name]);
    }
    fs::remove(folder_ + "/" + name);
    ASSERT_TRUE(write_tileset(*tiles_, folder_));
    EXPECT_EQ(*read_whole_file(folder_ + "/" + name), before[name]);
  }
  damage("tileset.json", 100);
  const auto again = write_tileset(*tiles_, folder_);
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->there);
  EXPECT_EQ(*read_whole_file(folder_ + "/tileset.json"), before["tileset.json"]);
}

TEST_F(Folder, AStoppedRunGoesOnOnlyFromWhatIsWhole) {
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double) { stop.request_stop(); };
  ASSERT_FALSE(write_tileset(*tiles_, folder_, {.threads = 1, .batch = 1}, progress));
  ASSERT_TRUE(fs::remove(folder_ + "/west/0/0/0.glb"));
  const auto report = write_tileset(*tiles_, folder_);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_TRUE(files().contains("west/0/0/0.glb"));
}

TEST_F(Folder, OfOtherTilesIsReplacedWithoutARest) {
  ASSERT_TRUE(write_tileset(*tiles_, folder_));
  const auto before = files();
  const test::MadeUpSource other(test::rough_terrain(60, 60, 5), {-7.1, 45.9}, 4e-4);
  const auto others = open(other);
  const auto report = write_tileset(*others, folder_);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_FALSE(report->there);
  EXPECT_EQ(files().size(), report->contents + report->subtrees + 3);
  EXPECT_NE(files(), before);
}

TEST_F(Folder, OfMoreOrFewerLevelsOfTheSameTilesIsThatOfThose) {
  const auto few = open(source_, 5), more = open(source_, 8);
  const auto content_of = [&] {
    std::map<std::string, std::string> all;
    for (const std::string& name : files()) all[name] = *read_whole_file(folder_ + "/" + name);
    return all;
  };
  ASSERT_TRUE(write_tileset(*more, folder_));
  const auto of_more = content_of();
  fs::remove_all(folder_);
  ASSERT_TRUE(write_tileset(*few, folder_));
  const auto of_few = content_of();
  ASSERT_NE(of_few.size(), of_more.size());
  ASSERT_TRUE(write_tileset(*more, folder_));
  EXPECT_EQ(content_of(), of_more);
  ASSERT_TRUE(write_tileset(*few, folder_));
  EXPECT_EQ(content_of(), of_few);
}

TEST_F(Folder, OfFewerTilesHasNoEmptyFolders) {
  ASSERT_TRUE(write_tileset(*open(source_, 8), folder_));
  const auto deep = [&](const std::string& name) { return folder_ + "/east/" + name; };
  ASSERT_TRUE(fs::exists(deep("8")));
  ASSERT_TRUE(write_tileset(*open(source_, 5), folder_));
  EXPECT_FALSE(fs::exists(deep("8")));
  EXPECT_TRUE(fs::exists(deep("5")));
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    EXPECT_FALSE(entry.is_directory() && fs::is_empty(entry.path())) << entry.path();
}

TEST_F(Folder, AStoppedRunLeavesNoTileset) {
  ASSERT_TRUE(write_tileset(*tiles_, folder_));
  const test::MadeUpSource other(test::rough_terrain(120, 100, 6), {7.1, 45.9}, 4e-4);
  const auto others = open(other);
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double) { stop.request_stop(); };
  const auto stopped = write_tileset(*others, folder_, {.threads = 1}, progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  EXPECT_FALSE(files().contains("tileset.json"));
  const auto again = write_tileset(*others, folder_);
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->there);
  EXPECT_TRUE(files().contains("tileset.json"));
}

/// The bytes of every file of a tileset, by name.
std::map<std::string, std::string> tileset_in(const std::string& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && !entry.path().filename().string().starts_with("tind-"))
      all[entry.path().lexically_relative(folder).string()] =
          *read_whole_file(entry.path().string());
  return all;
}

TEST_F(Folder, ARunThatWasStoppedGoesOnWhereItWas) {
  const std::string whole = dir_.file("whole");
  const auto all = write_tileset(*tiles_, whole);
  ASSERT_TRUE(all);
  std::uint64_t done = 0, runs = 0;
  for (;; ++runs) {
    ASSERT_LT(runs, 100u);
    std::stop_source stop;
    Progress progress;
    progress.stop = stop.get_token();
    progress.report = [&](double) { stop.request_stop(); };
    const auto run = write_tileset(*tiles_, folder_, {.threads = 1, .batch = 1}, progress);
    if (run) {
      EXPECT_EQ(run->kept_subtrees, done);
      break;
    }
    ASSERT_EQ(run.error().code, Errc::cancelled) << run.error().what;
    EXPECT_FALSE(files().contains("tileset.json"));
    ++done;  // a run makes one subtree, and never one that is done
  }
  EXPECT_GE(runs, 3u);
  EXPECT_GE(done + 1, all->subtrees);
  EXPECT_LE(done, all->subtrees);
  EXPECT_EQ(tileset_in(folder_), tileset_in(whole));
}

TEST_F(Folder, WhatIsDoneOfOtherTilesIsNotTakenForDone) {
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double) { stop.request_stop(); };
  ASSERT_FALSE(write_tileset(*tiles_, folder_, {.threads = 1, .batch = 1}, progress));
  const test::MadeUpSource other(test::rough_terrain(120, 100, 6), {7.1, 45.9}, 4e-4);
  const auto others = open(other);
  const auto report = write_tileset(*others, folder_);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->kept_subtrees, 0u);
  const std::string whole = dir_.file("whole");
  ASSERT_TRUE(write_tileset(*others, whole));
  EXPECT_EQ(tileset_in(folder_), tileset_in(whole));
}

TEST_F(Folder, OneRunAtATime) {
  ASSERT_TRUE(write_tileset(*tiles_, folder_));
  const auto before = tileset_in(folder_);
  const test::MadeUpSource other(test::rough_terrain(60, 60, 5), {-7.1, 45.9}, 4e-4);
  const auto others = open(other);
  {
    const auto held = FolderLock::take(folder_);
    ASSERT_TRUE(held);
    const auto refused = write_tileset(*others, folder_);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, Errc::busy);
    EXPECT_EQ(tileset_in(folder_), before);
  }
  EXPECT_TRUE(write_tileset(*others, folder_));
}

TEST_F(Folder, AKilledRunLeavesNothingInTheWayOfTheNext) {
  fs::create_directories(folder_ + "/");
  auto lock = FolderLock::take(folder_);
  ASSERT_TRUE(lock);
  lock->leave_behind();
  std::ofstream(folder_ + "/tind-3dtiles.json.part") << "{";
  { const auto gone = std::move(*lock); }
  const auto report = write_tileset(*tiles_, folder_);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_FALSE(files().contains("tind-lock"));
  EXPECT_FALSE(files().contains("tind-3dtiles.json.part"));
}

TEST_F(Folder, FilesOfOthersInItStay) {
  ASSERT_TRUE(write_tileset(*tiles_, folder_));
  std::ofstream(folder_ + "/index.html") << "mine";
  std::ofstream(folder_ + "/west/notes.txt") << "mine, too";
  const test::MadeUpSource other(test::rough_terrain(60, 60, 5), {-7.1, 45.9}, 4e-4);
  ASSERT_TRUE(write_tileset(*open(other), folder_));
  EXPECT_EQ(*read_whole_file(folder_ + "/index.html"), "mine");
  EXPECT_EQ(*read_whole_file(folder_ + "/west/notes.txt"), "mine, too");
}

TEST_F(Folder, OfAnotherCompressionIsRefused) {
  ASSERT_TRUE(write_tileset(*tiles_, folder_));
  const auto before = tileset_in(folder_);
  const auto refused = write_tileset(*tiles_, folder_, {.compression = GlbCompression::meshopt});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_EQ(tileset_in(folder_), before);
}

TEST_F(Folder, OfSomebodyElseIsNotTouched) {
  fs::create_directories(folder_);
  std::ofstream(folder_ + "/tileset.json") << "{}";
  const auto refused = write_tileset(*tiles_, folder_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_EQ(files(), std::set<std::string>{"tileset.json"});
  EXPECT_EQ(*read_whole_file(folder_ + "/tileset.json"), "{}");
}

TEST_F(Folder, OfARecordThatCannotBeReadIsNotCalledAnothers) {
  fs::create_directories(folder_);
  ASSERT_EQ(::mkfifo((folder_ + "/tind-3dtiles.json").c_str(), 0666), 0);
  const auto failed = write_tileset(*tiles_, folder_);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, Errc::io);
}

TEST_F(Folder, ATileThatCannotBeMadeIsTheResult) {
  source_.reads_left = 3;
  const auto failed = write_tileset(*tiles_, folder_, {.threads = 1});
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, Errc::io);
  EXPECT_FALSE(files().contains("tileset.json"));
}

}  // namespace
}  // namespace tind::tiles3d
