// Scenery as files: the bytes of on demand, indices that say what is there, never another's files,
// never a part taken for whole.

#include "terrain/flightgear/scenery_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "terrain/base/file_io.h"
#include "terrain/base/sha1.h"
#include "terrain/flightgear/bucket.h"
#include "terrain/store/folder/folder_lock.h"
#include "tests/support/as_somebody_else.h"
#include "tests/support/made_up_source.h"

namespace tind::flightgear {
namespace {

namespace fs = std::filesystem;

class SceneryFolder : public ::testing::Test {
 protected:
  BucketPlan plan(double max_error_m = 10) const {
    return BucketPlan::make(source_, {max_error_m, Effort::fast}, *test::environment()).value();
  }
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file())
        all[entry.path().lexically_relative(folder_).string()] =
            *read_whole_file(entry.path().string());
    return all;
  }

  // Across a degree, and a folder of ten.
  test::MadeUpSource source_{test::rough_terrain(120, 100, 5), {9.9, 46.1}, 0.002};
  test::TempDir dir_;
  const std::string folder_ = dir_.file("scenery");
};

TEST_F(SceneryFolder, HoldsTheBytesOfOnDemandUnderTheirNames) {
  const auto report = write_scenery(plan(), folder_, {.threads = 2});
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->buckets, plan().buckets().size());
  EXPECT_EQ(report->kept, 0u);
  EXPECT_LE(report->worst_error_m, 10);
  auto there = files();
  std::uint64_t bytes = 0;
  for (const BucketId id : plan().buckets()) {
    const auto bucket = make_bucket(plan(), id);
    const std::string at = "Terrain/" + path_of(folder_of(id)) + "/";
    const std::string& btg = there[at + btg_name(id)];
    EXPECT_EQ(btg, std::string((*bucket)->btg_gz.begin(), (*bucket)->btg_gz.end()));
    EXPECT_EQ(there[at + stg_name(id)], (*bucket)->stg);
    bytes += btg.size() + (*bucket)->stg.size();
  }
  EXPECT_EQ(report->bytes, bytes);
}

/// As TerraSync goes: from the root, by what indices say; sums and lengths are as they say.
void follow(const std::map<std::string, std::string>& files, const std::string& folder,
            std::size_t& found) {
  const auto index = files.find(folder + ".dirindex");
  ASSERT_TRUE(index != files.end()) << folder;
  ++found;
  std::istringstream lines(index->second);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "version:1");
  std::getline(lines, line);
  EXPECT_EQ(line, "path:" + folder.substr(0, folder.empty() ? 0 : folder.size() - 1));
  while (std::getline(lines, line)) {
    std::istringstream parts(line);
    std::string kind, name, sum, bytes;
    std::getline(parts, kind, ':'), std::getline(parts, name, ':'), std::getline(parts, sum, ':'),
        std::getline(parts, bytes, ':');
    const auto it = files.find(folder + name + (kind == "d" ? "/.dirindex" : ""));
    ASSERT_TRUE(it != files.end()) << line;
    EXPECT_EQ(sum, sha1(it->second)) << line;
    if (kind == "d") {
      follow(files, folder + name + "/", found);
    } else {
      EXPECT_EQ(bytes, std::to_string(it->second.size()));
      ++found;
    }
  }
}

TEST_F(SceneryFolder, IndicesLeadToEveryFile) {
  ASSERT_TRUE(write_scenery(plan(), folder_, {.threads = 2}));
  std::size_t found = 0;
  const auto there = files();
  follow(there, "", found);
  EXPECT_EQ(found, there.size() - 1);  // but the record
  EXPECT_TRUE(there.contains("Objects/.dirindex"));
  EXPECT_TRUE(there.contains("Terrain/e000n40/e009n46/.dirindex"));
  EXPECT_TRUE(there.contains("Terrain/e010n40/e010n45/.dirindex"));
}

TEST_F(SceneryFolder, IsTheSameOnAnyNumberOfThreadsAndInPieces) {
  ASSERT_TRUE(write_scenery(plan(), folder_, {.threads = 1}));
  const auto whole = files();
  fs::remove_all(folder_);
  // Stopped after some buckets, torn in others.
  std::stop_source stop;
  Progress progress{[&](double share) {
                      if (share > 0.4) stop.request_stop();
                    },
                    stop.get_token()};
  const auto stopped = write_scenery(plan(), folder_, {.threads = 2}, progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  EXPECT_FALSE(fs::exists(folder_ + "/.dirindex"));
  std::size_t torn = 0;
  for (const auto& [name, bytes] : files())
    if (name.ends_with(".btg.gz") && torn++ == 0)
      std::ofstream(folder_ + "/" + name) << bytes.substr(0, bytes.size() / 2);
  ASSERT_GT(torn, 1u);
  const auto report = write_scenery(plan(), folder_, {.threads = 3});
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->kept, torn - 1);
  EXPECT_EQ(files(), whole);
  const auto again = write_scenery(plan(), folder_);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->there);
  EXPECT_EQ(again->bytes, report->bytes);
  EXPECT_EQ(files(), whole);
}

TEST_F(SceneryFolder, OfOtherOptionsTakesThePlaceOfWhatWasThere) {
  ASSERT_TRUE(write_scenery(plan(10), folder_));
  const auto before = files();
  std::ofstream(folder_ + "/Terrain/notes.txt") << "mine";
  const auto refused = write_scenery(plan(20), folder_);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("--force"), std::string::npos);
  EXPECT_EQ(files().size(), before.size() + 1) << "nothing was touched";
  const auto report = write_scenery(plan(20), folder_, {.force = true});
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->kept, 0u);
  auto after = files();
  EXPECT_EQ(after["Terrain/notes.txt"], "mine");
  after.erase("Terrain/notes.txt");
  EXPECT_EQ(after.size(), before.size());
  EXPECT_NE(after, before);
}

TEST_F(SceneryFolder, AnIndexThatIsGoneOrCutOffIsMadeAgain) {
  ASSERT_TRUE(write_scenery(plan(), folder_));
  const auto whole = files();
  for (const std::string folder : {"", "Terrain/", "Terrain/e000n40/e009n46/", "Models/"}) {
    const std::string file = folder_ + "/" + folder + ".dirindex";
    for (const bool gone : {true, false}) {
      if (gone)
        fs::remove(file);
      else
        fs::resize_file(file, fs::file_size(file) - 3);
      const auto report = write_scenery(plan(), folder_);
      ASSERT_TRUE(report);
      EXPECT_FALSE(report->there) << file;
      EXPECT_EQ(files(), whole) << file;
    }
  }
  EXPECT_TRUE(write_scenery(plan(), folder_)->there);
}

TEST_F(SceneryFolder, TakesAwayBucketsOfBeforeAndNothingOfOthers) {
  const BucketId gone = bucket_at({8.5, 45.5});  // in no plan here
  const std::string one = "Terrain/" + path_of(folder_of(gone)) + "/";
  const std::string taken[] = {one + btg_name(gone), one + stg_name(gone),
                               one + btg_name(gone) + ".part", one + ".dirindex"};
  const BucketId anothers = bucket_at({8.5, 45.7});
  const std::string ours_too = "Terrain/e000n40/e009n46/";
  const std::map<std::string, std::string> stay = {
      {one + "KSEA.btg.gz", "mine"},
      {one + "KSEA.stg", "OBJECT_STATIC mine.ac 1 2 3 4\n"},
      {one + "notes.part", "mine"},
      {one + "0123.stg", "mine"},
      {one + btg_name(anothers), "another's"},
      {one + stg_name(anothers), "OBJECT_BASE " + btg_name(anothers) + "\n"},
      {ours_too + "KSEA.btg.gz", "mine"},
      {ours_too + btg_name(gone), "of another folder"},
      {"Terrain/" + btg_name(gone), "in none"},
      {"Terrain/mine/" + stg_name(gone), "in none of ours"},
      {"Terrain/w130n40/.dirindex", "version:1\npath:Terrain/w130n40\nd:w122n46:1\nd:mine:1\n"},
      {"Terrain/w130n40/w122n47/.dirindex",
       "version:1\npath:Terrain/w130n40/w122n47\nf:KSEA.btg.gz:1:1\n"},
      {"Objects/.dirindex", "version:1\npath:Objects\nd:w130n40:1\n"},
      {"Objects/w130n40/.dirindex", "version:1\npath:Objects/w130n40\n"},
  };
  ASSERT_TRUE(write_scenery(plan(10), folder_));
  const auto put = [&](const std::string& name, const std::string& text) {
    fs::create_directories(fs::path(folder_ + "/" + name).parent_path());
    std::ofstream(folder_ + "/" + name) << text;
  };
  for (const std::string& name : taken) put(name, "");
  put(one + ".dirindex",
      "version:1\npath:" + one.substr(0, one.size() - 1) + "\nf:" + stg_name(gone) + ":1:1\n");
  for (const auto& [name, text] : stay) put(name, text);
  ASSERT_TRUE(write_scenery(plan(20), folder_, {.force = true}));
  auto there = files();
  for (const std::string& name : taken) EXPECT_FALSE(there.contains(name)) << name;
  for (const auto& [name, text] : stay) EXPECT_EQ(there[name], text) << name;
  EXPECT_NE(there[".dirindex"].find("d:Objects:" + sha1(there["Objects/.dirindex"])),
            std::string::npos);
}

TEST_F(SceneryFolder, ALinkInTheWayIsRefusedBeforeAnythingIsChanged) {
  ASSERT_TRUE(write_scenery(plan(10), folder_));
  const auto before = files();
  const BucketId bucket = plan().buckets().front();
  const std::string one = "Terrain/" + path_of(folder_of(bucket));
  for (const std::string& place : {std::string("Terrain"), one.substr(0, one.rfind('/')), one,
                                   one + "/" + btg_name(bucket), one + "/" + stg_name(bucket)}) {
    const std::string at = folder_ + "/" + place, elsewhere = dir_.file("elsewhere");
    fs::rename(at, elsewhere);
    fs::create_symlink(elsewhere, at);
    for (const double max_error_m : {10., 20.}) {
      const auto refused = write_scenery(plan(max_error_m), folder_, {.force = true});
      ASSERT_FALSE(refused) << place;
      EXPECT_EQ(refused.error().code, Errc::invalid_argument);
      EXPECT_NE(refused.error().what.find(at + " is in the place of"), std::string::npos);
    }
    EXPECT_TRUE(fs::is_symlink(at));
    fs::remove(at);
    fs::rename(elsewhere, at);
    EXPECT_EQ(files(), before) << place;
  }
}

TEST_F(SceneryFolder, ALinkThatMayHideBucketsOfBeforeIsRefused) {
  const BucketId gone = bucket_at({8.5, 45.5});  // in no plan here
  const std::string one = folder_ + "/Terrain/" + path_of(folder_of(gone));
  ASSERT_TRUE(write_scenery(plan(10), folder_));
  const auto before = files();
  fs::create_directory_symlink(dir_.path(), one);
  EXPECT_EQ(write_scenery(plan(20), folder_, {.force = true}).error().code, Errc::invalid_argument);
  EXPECT_TRUE(write_scenery(plan(10), folder_)) << "it is not in the way of these";
  fs::remove(one);
  fs::create_directory(one);
  fs::create_symlink(dir_.file("none"), one + "/" + btg_name(gone));
  EXPECT_EQ(write_scenery(plan(20), folder_, {.force = true}).error().code, Errc::invalid_argument);
  EXPECT_EQ(files(), before);
}

TEST_F(SceneryFolder, BucketsOfBeforeThatCannotBeLookedAtDoNotComeUnderANewRecord) {
  ASSERT_TRUE(write_scenery(plan(10), folder_));
  const BucketPlan other = plan(20);
  const BucketId gone = bucket_at({8.5, 45.5});  // in neither
  const std::string closed = folder_ + "/Terrain/" + path_of(folder_of(gone));
  fs::create_directories(closed);
  std::ofstream(closed + "/" + btg_name(gone)) << "old";
  const auto before = files();
  for (const auto& entry : fs::recursive_directory_iterator(dir_.path()))
    if (entry.is_directory()) fs::permissions(entry.path(), fs::perms(0777));
  fs::permissions(dir_.path(), fs::perms(0755));
  for (const fs::perms perms : {fs::perms::none, fs::perms(0444)}) {
    fs::permissions(closed, perms);
    {
      const test::AsSomebodyElse nobody;
      const auto failed = write_scenery(other, folder_, {.force = true});
      ASSERT_FALSE(failed);
      EXPECT_EQ(failed.error().code, Errc::io);
    }
    fs::permissions(closed, fs::perms(0755));
    EXPECT_EQ(files(), before);
  }
  const auto report = write_scenery(other, folder_, {.force = true});
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->kept, 0u);
  EXPECT_FALSE(fs::exists(closed)) << "with what was in it";
}

TEST_F(SceneryFolder, OfARecordThatCannotBeReadIsNotCalledAnothers) {
  fs::create_directories(folder_);
  ASSERT_EQ(::mkfifo((folder_ + "/tind-flightgear.txt").c_str(), 0666), 0);
  EXPECT_EQ(write_scenery(plan(), folder_, {.force = true}).error().code, Errc::io);
}

TEST_F(SceneryFolder, GoesOnFromAKillJustBeforeItsRecordWasThere) {
  fs::create_directories(folder_);
  const std::string left = folder_ + "/tind-flightgear.txt.partial-0123456789abcdef";
  std::ofstream(left) << "scenery";
  std::ofstream(left + "0") << "mine";  // no name that a run gives
  EXPECT_EQ(write_scenery(plan(), folder_).error().code, Errc::invalid_argument);
  EXPECT_TRUE(fs::exists(left));
  fs::remove(left + "0");
  const auto report = write_scenery(plan(), folder_);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(SceneryFolder, OfSomebodyElseIsRefused) {
  fs::create_directories(folder_);
  std::ofstream(folder_ + "/mine.txt") << "mine";
  const auto report = write_scenery(plan(), folder_);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, Errc::invalid_argument);
  EXPECT_EQ(files().size(), 1u);
}

TEST_F(SceneryFolder, IsWrittenByOneAtATime) {
  fs::create_directories(folder_);
  {
    const auto other = FolderLock::take(folder_);
    ASSERT_TRUE(other);
    const auto busy = write_scenery(plan(), folder_);
    ASSERT_FALSE(busy);
    EXPECT_EQ(busy.error().code, Errc::busy);
  }
  EXPECT_TRUE(write_scenery(plan(), folder_));
  EXPECT_FALSE(fs::exists(folder_ + "/tind-lock"));
}

TEST_F(SceneryFolder, AFailedReadLeavesNoRootIndex) {
  const BucketPlan p = plan();
  source_.reads_left = 3;
  const auto report = write_scenery(p, folder_, {.threads = 1});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, Errc::io);
  EXPECT_FALSE(fs::exists(folder_ + "/.dirindex"));
}

}  // namespace
}  // namespace tind::flightgear
