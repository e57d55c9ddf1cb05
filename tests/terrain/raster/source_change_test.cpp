// Files that change while a source reads them: what is answered is of the content that was opened,
// or nothing is.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "terrain/raster/dem_source.h"
#include "tests/support/srtm.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

using test::overwrite_bytes, test::write_bytes, test::srtm;
constexpr int kSide = test::kSrtmSide;

std::shared_ptr<const DemSource> open(const std::string& path, DemOptions options = {}) {
  options.cache_bytes = 1;  // one block: everything is read again and again
  const auto source = DemSource::open({&path, 1}, options);
  EXPECT_TRUE(source) << source.error().what;
  return source ? *source : nullptr;
}

struct Change {
  const char* name;
  const char* said;  // of it
  void (*make)(const std::string& path);
};

const Change kChanges[] = {
    {"overwritten in place", "was written to",
     [](const std::string& path) { overwrite_bytes(path, srtm(222)); }},
    {"another moved over it", "was replaced",
     [](const std::string& path) {
       write_bytes(path + ".new", srtm(222));
       fs::rename(path + ".new", path);
     }},
    {"another of the same time moved over it", "was replaced",
     [](const std::string& path) {
       write_bytes(path + ".new", srtm(222));
       fs::last_write_time(path + ".new", fs::last_write_time(path));
       fs::rename(path + ".new", path);
     }},
    {"made empty and written again", "",
     [](const std::string& path) { write_bytes(path, srtm(222)); }},
    {"cut", "became shorter", [](const std::string& path) { fs::resize_file(path, 1000000); }},
    {"removed", "is no longer there", [](const std::string& path) { fs::remove(path); }},
};

TEST(SourceChange, IsRefusedHoweverItCameAbout) {
  for (const Change& change : kChanges) {
    SCOPED_TRACE(change.name);
    const test::TempDir folder;
    const std::string path = folder.file("N46E007.hgt");
    write_bytes(path, srtm(111));
    const auto source = open(path);
    ASSERT_TRUE(source);
    EXPECT_EQ(source->read(0, 0, 2, 2)->at(1, 1), 111);
    change.make(path);
    for (const auto& got :
         {source->read(600, 600, 2, 2), source->read_decimated(0, 0, 4, 4, 300)}) {
      ASSERT_FALSE(got) << got->at(0, 0);
      EXPECT_EQ(got.error().code, Errc::io);
      EXPECT_THAT(got.error().what, AllOf(HasSubstr(path), HasSubstr(change.said)));
    }
  }
}

TEST(SourceChange, UnderManyReadersEveryAnswerIsOfTheOldContent) {
  for (const Change& change : kChanges) {
    SCOPED_TRACE(change.name);
    const test::TempDir folder;
    const std::string path = folder.file("N46E007.hgt");
    write_bytes(path, srtm(111));
    const auto source = open(path);
    ASSERT_TRUE(source);
    std::atomic<bool> changed = false;
    std::atomic<int> right = 0, refused = 0, wrong = 0, other_errors = 0;
    const auto reader = [&](unsigned seed) {
      std::mt19937 random(seed);
      for (int after = 0; after < 50; after += changed) {
        const int col = int(random() % (kSide - 40)), row = int(random() % (kSide - 40));
        const auto got = random() % 4 == 0 ? source->read_decimated(col % 64, row % 64, 3, 3, 300)
                                           : source->read(col, row, 40, 40);
        if (!got) {
          ++(got.error().code == Errc::io ? refused : other_errors);
        } else {
          ++(std::ranges::all_of(got->values(), [](float z) { return z == 111; }) ? right : wrong);
        }
      }
    };
    std::vector<std::jthread> readers;
    for (unsigned i = 0; i < 4; ++i) readers.emplace_back(reader, i);
    while (right < 40) std::this_thread::yield();
    change.make(path);
    changed = true;
    readers.clear();
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(other_errors, 0);
    EXPECT_GE(refused, 100);
  }
}

TEST(SourceChange, AWriteInTheSameTickIsSeen) {
  for (int round = 0; round < 20; ++round) {
    const test::TempDir folder;
    const std::string path = folder.file("N46E007.hgt");
    write_bytes(path, srtm(111));
    const auto source = open(path);
    ASSERT_TRUE(source);
    overwrite_bytes(
        path,
        srtm(222));  // the clock of files may not have moved since write_bytes() but for open()
    const auto got = source->read(0, 0, 1, 1);
    EXPECT_FALSE(got) << "round " << round << ": " << got->at(0, 0);
  }
}

TEST(SourceChange, PutBackAsItWasItIsReadAgain) {
  const test::TempDir folder;
  const std::string path = folder.file("N46E007.hgt");
  write_bytes(path, srtm(111));
  const auto source = open(path);
  ASSERT_TRUE(source);
  fs::rename(path, path + ".old");
  EXPECT_FALSE(source->read(0, 0, 1, 1));
  write_bytes(path, srtm(222));
  EXPECT_FALSE(source->read(0, 0, 1, 1));
  fs::rename(path + ".old", path);
  const auto got = source->read(0, 0, 1, 1);
  ASSERT_TRUE(got) << got.error().what;
  EXPECT_EQ(got->at(0, 0), 111);
}

TEST(SourceChange, RightsAndLinksDoNotMatter) {
  const test::TempDir folder;
  const std::string path = folder.file("N46E007.hgt");
  write_bytes(path, srtm(111));
  const auto source = open(path);
  ASSERT_TRUE(source);
  fs::create_hard_link(path, path + ".link");
  ASSERT_EQ(::chmod(path.c_str(), 0600), 0);
  EXPECT_TRUE(source->read(0, 0, 1, 1));
}

TEST(SourceChange, SidecarsArePartOfTheSource) {
  const test::TempDir folder;
  const std::string path = folder.file("desert.asc"), prj = folder.file("desert.prj");
  fs::copy_file(test::testdata("desert.asc"), path);
  fs::copy_file(test::testdata("desert.prj"), prj);
  const auto source = open(path);
  ASSERT_TRUE(source);
  ASSERT_TRUE(source->read(0, 0, 2, 2));
  std::ofstream(prj, std::ios::app) << " ";
  const auto got = source->read_decimated(0, 0, 1, 1, 64);
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error().what, HasSubstr("desert.prj"));
}

/// A mask makes other heights.
TEST(SourceChange, OverviewsMayComeMeanwhileMasksMayNot) {
  const test::TempDir folder;
  const std::string path = folder.file("crater.tif");
  fs::copy_file(test::testdata("crater.tif"), path);
  const auto source = open(path);
  ASSERT_TRUE(source);
  const auto open_anew = [&] {  // a handle that met a change is not used again
    fs::rename(path, path + ".old");
    EXPECT_FALSE(source->read(0, 0, 1, 1));
    fs::rename(path + ".old", path);
  };
  fs::copy_file(test::testdata("crater.tif"), path + ".ovr");
  open_anew();
  const auto got = source->read(0, 0, 2, 2);
  EXPECT_TRUE(got) << got.error().what;
  EXPECT_TRUE(source->unchanged());
  fs::copy_file(test::testdata("crater.tif"), path + ".msk");
  const auto masked = source->read(0, 400, 2, 2);  // also by who has it open
  ASSERT_FALSE(masked);
  EXPECT_THAT(masked.error().what, HasSubstr("crater.tif.msk: was put beside"));
  EXPECT_FALSE(source->unchanged());
  fs::remove(path + ".msk");
  EXPECT_TRUE(source->read(0, 0, 2, 2));
}

TEST(SourceChange, APartOfAVrtIsPartOfTheSource) {
  const test::TempDir folder;
  const std::string part = folder.file("N46E007.hgt"), path = folder.file("all.vrt");
  write_bytes(part, srtm(111));
  std::ofstream(path) << R"(<VRTDataset rasterXSize="1201" rasterYSize="1201">
    <GeoTransform>7, 0.001, 0, 47, 0, -0.001</GeoTransform>
    <VRTRasterBand dataType="Int16" band="1"><SimpleSource>
      <SourceFilename relativeToVRT="1">N46E007.hgt</SourceFilename><SourceBand>1</SourceBand>
    </SimpleSource></VRTRasterBand></VRTDataset>)";
  const std::string outer = folder.file("outer.vrt");
  std::ofstream(outer) << R"(<VRTDataset rasterXSize="1201" rasterYSize="1201">
    <GeoTransform>7, 0.001, 0, 47, 0, -0.001</GeoTransform>
    <VRTRasterBand dataType="Int16" band="1"><SimpleSource>
      <SourceFilename relativeToVRT="1">all.vrt</SourceFilename><SourceBand>1</SourceBand>
    </SimpleSource></VRTRasterBand></VRTDataset>)";
  const auto source = open(path, {.allow_vrt = true}), nested = open(outer, {.allow_vrt = true});
  ASSERT_TRUE(source && nested);
  EXPECT_EQ(source->read(0, 0, 1, 1)->at(0, 0), 111);
  EXPECT_EQ(nested->read(0, 0, 1, 1)->at(0, 0), 111);
  overwrite_bytes(part, srtm(222));
  for (const auto& s : {source, nested}) {
    const auto got = s->read(900, 900, 1, 1);
    ASSERT_FALSE(got) << got->at(0, 0);
    EXPECT_THAT(got.error().what, HasSubstr("N46E007.hgt"));
  }
}

TEST(SourceChange, AFileOfSeveralIsRefusedAndTheOthersAreNot) {
  const test::TempDir folder;
  const std::vector<std::string> files = {folder.file("N46E007.hgt"), folder.file("N46E008.hgt")};
  for (const std::string& file : files) write_bytes(file, srtm(111));
  const auto source = DemSource::open(files, {.cache_bytes = 1});
  ASSERT_TRUE(source) << source.error().what;
  overwrite_bytes(files[1], srtm(222));
  EXPECT_TRUE((*source)->read(0, 0, 2, 2));
  EXPECT_FALSE((*source)->read(2000, 0, 2, 2));
  EXPECT_FALSE((*source)->read(1190, 0, 200, 2));
}

TEST(SourceChange, AChangeBeforeTheFirstReadGivesAnotherFingerprint) {
  const test::TempDir folder;
  const std::string path = folder.file("N46E007.hgt");
  write_bytes(path, srtm(111));
  const auto time = fs::last_write_time(path);
  const std::string first = open(path)->info().fingerprint;
  EXPECT_EQ(open(path)->info().fingerprint, first);
  // One post in the middle, and the old size and time: the ends and the time do not tell.
  std::string bytes = srtm(111);
  bytes[bytes.size() / 2] = 1;
  overwrite_bytes(path, bytes);
  fs::last_write_time(path, time);
  EXPECT_NE(open(path)->info().fingerprint, first);
}

}  // namespace
}  // namespace tind
