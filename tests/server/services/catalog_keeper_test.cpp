// What a catalog becomes of what the operator says, time after time.

#include "server/services/datasets/catalog_keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "server/services/datasets/dataset_settings.h"
#include "server/services/datasets/opener.h"
#include "terrain/raster/sandboxed_pool.h"
#include "tests/support/flat_dem.h"
#include "tests/support/geoid_file.h"
#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Keeper : public testing::Test {
 protected:
  explicit Keeper(std::shared_ptr<SourcePool> pool = SourcePool::make({}))
      : keeper_(catalog_,
                {.read =
                     [file = folder_.file("tind.toml")] {
                       return read_config(
                           {.file = file, .environment = {}, .flags = {}, .datasets = {}});
                     },
                 .environment = test::environment(),
                 .pool = std::move(pool)}) {
    spdlog::set_level(spdlog::level::off);
  }
  ~Keeper() override { spdlog::set_level(spdlog::level::info); }

  std::string in_folder(const std::string& name) const { return folder_.file(name); }
  /// Resting since long ago.
  void dem(const std::string& name, int height = 1) {
    test::write_flat_dem(in_folder(name), height);
    for (const char* const ending : {".asc", ".prj"})
      fs::last_write_time(fs::path(in_folder(name)).replace_extension(ending),
                          fs::file_time_type::clock::now() - 1h);
  }
  void text(const std::string& name, const std::string& text) {
    std::ofstream(in_folder(name)) << text;
    fs::last_write_time(in_folder(name), fs::file_time_type::clock::now() - 1h);
  }
  CatalogChange load(const std::string& toml) {
    std::ofstream(in_folder("tind.toml")) << toml;
    auto change = keeper_.load();
    why_ = change ? std::string() : change.error()[0].what;
    return change ? *change : CatalogChange{};
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& dataset : catalog_.all()) names.push_back(dataset->name);
    return names;
  }
  /// Of its only post that everybody asks for.
  float height(const std::string& name) const {
    return catalog_.find(name)->source->only()->read(3, 3, 1, 1)->at(0, 0);
  }

  test::TempDir folder_;
  Catalog catalog_;
  CatalogKeeper keeper_;
  std::string why_;
};

std::string table(const std::string& name, const std::string& files, const std::string& more = {}) {
  return "[[dataset]]\nname = \"" + name + "\"\nfiles = [\"" + files + "\"]\n" + more;
}

TEST_F(Keeper, KeepsWhatIsSaidAsBeforeOfFilesAsTheyWere) {
  dem("a.asc", 1);
  dem("b.asc", 2);
  dem("c.asc", 3);
  EXPECT_THAT(load(table("a", "a.asc") + table("b", "b.asc") + table("c", "c.asc")).added,
              ElementsAre("a", "b", "c"));
  const auto a = catalog_.find("a"), b = catalog_.find("b"), c = catalog_.find("c");
  dem("b.asc", 20);
  const CatalogChange change =
      load(table("c", "c.asc", "max_error = 9\n") + table("b", "b.asc") + table("a", "a.asc"));
  EXPECT_EQ(change.kept, 1u);
  EXPECT_THAT(change.replaced, ElementsAre("c", "b"));
  EXPECT_EQ(catalog_.find("a"), a);
  EXPECT_NE(catalog_.find("b")->index, b->index);
  EXPECT_NE(catalog_.find("c")->index, c->index);
  EXPECT_EQ(height("b"), 20);
  EXPECT_THAT(names(), ElementsAre("c", "b", "a"));
}

TEST_F(Keeper, ADatasetWhoseLakeHasChangedIsOpenedAnew) {
  dem("a.asc", 1);
  const auto lake = [&](const char* level) {
    text("lake.geojson", std::string(R"({"type":"Polygon","coordinates":[[)") + "[9,45," + level +
                             "],[11,45," + level + "],[11,47," + level + "],[9,47," + level +
                             "],[9,45," + level + "]]]}");
  };
  lake("50");
  const std::string config = table("a", "a.asc", "flatten = [\"lake.geojson\"]\n");
  EXPECT_THAT(load(config).added, ElementsAre("a")) << why_;
  const auto old = catalog_.find("a");
  EXPECT_EQ(height("a"), 50);
  EXPECT_EQ(load(config).kept, 1u);
  lake("70");
  EXPECT_FALSE(old->unchanged());
  EXPECT_EQ(old->source->only()->read(3, 3, 1, 1)->at(0, 0), 50);  // as it was opened
  EXPECT_THAT(load(config).replaced, ElementsAre("a"));
  EXPECT_EQ(height("a"), 70);
  EXPECT_NE(catalog_.find("a")->index, old->index);
  dem("a.asc", 2);  // a DEM with a lake is looked at, too
  EXPECT_THAT(load(config).replaced, ElementsAre("a"));
  fs::remove(in_folder("lake.geojson"));
  load(config);
  EXPECT_THAT(why_, HasSubstr("lake.geojson"));
  EXPECT_EQ(height("a"), 70);
}

TEST_F(Keeper, AReloadSeesWhatWasWrittenUnderItsOldTime) {
  dem("a.asc", 1);
  dem("b.asc", 2);
  const auto time = fs::last_write_time(in_folder("a.asc"));
  EXPECT_THAT(load(table("a", "a.asc")).added, ElementsAre("a")) << why_;
  EXPECT_EQ(load(table("a", "a.asc")).kept, 1u);
  fs::copy_file(in_folder("b.asc"), in_folder("a.asc"), fs::copy_options::overwrite_existing);
  fs::last_write_time(in_folder("a.asc"), time);
  EXPECT_TRUE(catalog_.find("a")->unchanged());
  EXPECT_THAT(load(table("a", "a.asc")).replaced, ElementsAre("a"));
  EXPECT_EQ(height("a"), 2);
}

TEST_F(Keeper, ARenamedDatasetIsNotReadAgain) {
  dem("a.asc");
  load(table("a", "a.asc"));
  const auto a = catalog_.find("a");
  const CatalogChange change = load(table("z", "a.asc"));
  EXPECT_THAT(change.added, ElementsAre("z"));
  EXPECT_THAT(change.removed, ElementsAre("a"));
  EXPECT_EQ(catalog_.find("a"), nullptr);
  EXPECT_EQ(catalog_.find("z")->source, a->source);
  EXPECT_NE(catalog_.find("z")->index, a->index);
}

TEST_F(Keeper, WhatIsRemovedLivesAsLongAsWhoUsesIt) {
  dem("a.asc", 7);
  dem("b.asc");
  load(table("a", "a.asc") + table("b", "b.asc"));
  const auto in_use = catalog_.find("a");
  EXPECT_THAT(load(table("b", "b.asc")).removed, ElementsAre("a"));
  EXPECT_EQ(catalog_.find("a"), nullptr);
  EXPECT_EQ(in_use->source->only()->read(3, 3, 1, 1)->at(0, 0), 7);
}

TEST_F(Keeper, IsAllOrNothing) {
  dem("a.asc");
  dem("b.asc");
  load(table("a", "a.asc"));
  const auto a = catalog_.find("a");
  const std::uint64_t revision = catalog_.revision();
  fs::create_directory(in_folder("empty"));
  text("text.asc", "this is no raster\n");
  fs::create_symlink("loop.asc", in_folder("loop.asc"));
  fs::create_symlink("loop", in_folder("loop"));
  const struct {
    std::string toml, words;
  } bad[] = {
      {"", "nothing to serve"},
      {table("b", "b.asc") + table("c", "c.asc"), "c.asc"},
      {table("b", "b.asc") + table("c", "*.hgt"), "no file fits"},
      {table("b", "b.asc") + table("b", "a.asc"), "a second dataset b"},
      {table("b", "b.asc") + table("c", "text.asc"), "text.asc"},
      {table("b", "b.asc") + table("c", "empty"), "empty"},
      {table("b", "b.asc") + table("c", "loop.asc"), "loop.asc"},
      {table("b", "b.asc") + "[[dataset]]\nfiles = [\"loop\"]\n", "loop"},
      {table("b", "b.asc") + table("c", std::string(300, 'x') + ".asc"), "xxx.asc"},
      {table("b", "b.asc") + "[[dataset]]\nname = \"half", "tind.toml:"},
      {"catalog = \"" + in_folder("none") + "\"\n", "cannot look into"},
  };
  for (const auto& [toml, words] : bad) {
    load(toml);
    EXPECT_THAT(why_, HasSubstr(words)) << toml;
    EXPECT_THAT(names(), ElementsAre("a"));
    EXPECT_EQ(catalog_.find("a"), a);
  }
  fs::remove(in_folder("tind.toml"));
  EXPECT_FALSE(keeper_.load());
  EXPECT_EQ(catalog_.revision(), revision);
}

TEST_F(Keeper, SaysWhatOnlyARestartChanges) {
  dem("a.asc");
  EXPECT_THAT(load("queue = 3\n" + table("a", "a.asc")).for_restart, IsEmpty());
  EXPECT_THAT(load("queue = 4\nmax_error = 2\n" + table("a", "a.asc")).for_restart,
              ElementsAre("queue"));
  // Not once only: it is still not so.
  EXPECT_THAT(load("queue = 4\nmax_error = 2\n" + table("a", "a.asc")).for_restart,
              ElementsAre("queue"));
  EXPECT_THAT(load("queue = 3\n" + table("a", "a.asc")).for_restart, IsEmpty());
}

TEST_F(Keeper, OneWithoutANameMakesRoomForOneWithIt) {
  dem("a.asc", 1);
  dem("b.asc", 2);
  load("[[dataset]]\nfiles = [\"a.asc\"]\n" + table("a", "b.asc"));
  EXPECT_THAT(names(), ElementsAre("a-2", "a"));
  EXPECT_EQ(height("a"), 2);
}

TEST_F(Keeper, OfAFolderEachEntryStandsForItself) {
  fs::create_directories(in_folder("all/parts"));
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  dem("all/a.asc", 1);
  dem("all/parts/p.asc", 3);
  text("all/readme", "not a raster");
  text("all/broken.tif", "not a raster");
  dem("b.asc", 4);
  text("all/tabled.toml", "files = [\"../*.asc\"]\nmax_error = 3\n");
  fs::create_symlink(in_folder("b.asc"), in_folder("all/linked.asc"));
  fs::create_symlink(in_folder("b.prj"), in_folder("all/linked.prj"));
  fs::create_symlink("nowhere", in_folder("all/dangling.asc"));
  load(toml);
  EXPECT_EQ(why_, "");
  ASSERT_THAT(names(), ElementsAre("a", "linked", "parts", "tabled"));
  EXPECT_EQ(height("parts"), 3);
  EXPECT_EQ(height("tabled"), 4);
  EXPECT_EQ(height("linked"), 4);
  EXPECT_EQ(keeper_.status().aside.size(), 3u);  // readme, broken.tif, dangling.asc

  const auto a = catalog_.find("a"), tabled = catalog_.find("tabled");
  text("all/tabled.toml", "files = [\"../*.asc");
  fs::remove(in_folder("all/linked.asc"));
  const CatalogChange change = load(toml);
  EXPECT_EQ(why_, "");
  EXPECT_THAT(change.removed, ElementsAre("linked"));
  EXPECT_EQ(catalog_.find("a"), a);
  EXPECT_EQ(catalog_.find("tabled"), tabled);  // half of a table is no reason to end it
}

/// A link to itself is what nobody can look at, root neither.
TEST_F(Keeper, WhatCannotBeLookedAtIsNotGone) {
  fs::create_directories(in_folder("all"));
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  dem("all/a.asc"), dem("all/b.asc");
  load(toml);
  EXPECT_THAT(names(), ElementsAre("a", "b"));
  const auto a = catalog_.find("a");
  for (const char* const name : {"all/a.asc", "all/b.asc"}) fs::remove(in_folder(name));
  fs::create_symlink("a.asc", in_folder("all/a.asc"));
  load(toml);
  EXPECT_THAT(names(), ElementsAre("a"));
  EXPECT_EQ(catalog_.find("a"), a);
}

TEST_F(Keeper, RawNumbersElsewhereAreNotServedByALink) {
  fs::create_directories(in_folder("all"));
  fs::create_directories(in_folder("elsewhere"));
  text("elsewhere/raw.bil", std::string(2 * 4 * 4, '\1'));
  text("elsewhere/raw.hdr",
       "NROWS 4\nNCOLS 4\nNBITS 16\nULXMAP 10\nULYMAP 46\nXDIM 0.1\nYDIM 0.1\n");
  fs::create_directories(in_folder("all/raw"));
  for (const char* const name : {"raw.bil", "raw.hdr"})
    fs::copy(in_folder(std::string("elsewhere/") + name),
             in_folder(std::string("all/raw/") + name));
  for (const char* const name : {"raw.bil", "raw.hdr"})
    fs::last_write_time(in_folder(std::string("all/raw/") + name),
                        fs::file_time_type::clock::now() - 1h);
  fs::create_directory_symlink(in_folder("elsewhere"), in_folder("all/linked"));
  load("catalog = \"" + in_folder("all") + "\"\ncrs = \"EPSG:4326\"\n");
  EXPECT_EQ(why_, "");
  EXPECT_THAT(names(), ElementsAre("raw"));
  const auto aside = keeper_.status().aside;
  ASSERT_EQ(aside.size(), 1u);
  EXPECT_THAT(aside.begin()->second, HasSubstr("a link to raw numbers elsewhere"));
}

/// Who opens a pipe may wait for ever, and with him those who wait for their turn.
TEST_F(Keeper, APipeIsNoFileOfATable) {
  dem("a.asc", 1);
  ASSERT_EQ(::mkfifo(in_folder("pipe").c_str(), 0600), 0);
  for (const char* const key : {"water", "flatten", "breaklines", "drape", "land_cover"}) {
    const bool list = std::string_view(key) != "drape" && std::string_view(key) != "land_cover";
    load(table("a", "a.asc", std::string(key) + (list ? " = [\"pipe\"]\n" : " = \"pipe\"\n")));
    EXPECT_THAT(why_, HasSubstr("is a device or a pipe")) << key;
  }
}

/// The mount point below a disk that is not mounted any more.
TEST_F(Keeper, AnEmptyFolderInTheOnesPlaceTakesNothingAway) {
  fs::create_directories(in_folder("all"));
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  dem("all/a.asc"), dem("all/b.asc");
  load(toml);
  EXPECT_THAT(names(), ElementsAre("a", "b"));
  fs::rename(in_folder("all"), in_folder("unmounted"));
  fs::create_directories(in_folder("all"));
  load(toml);
  EXPECT_THAT(why_, testing::HasSubstr("is its disk not mounted?"));
  EXPECT_THAT(names(), ElementsAre("a", "b"));
  dem("all/b.asc");  // another folder, with something in it: that is what is wanted
  load(toml);
  EXPECT_EQ(why_, "");
  EXPECT_THAT(names(), ElementsAre("b"));
  fs::remove(in_folder("all/b.asc"));  // taken away, from the same one
  fs::remove(in_folder("all/b.prj"));
  load(toml);
  EXPECT_EQ(why_, "");
  EXPECT_THAT(names(), ElementsAre());
}

TEST_F(Keeper, ACommentMoreChangesNoDataset) {
  fs::create_directories(in_folder("all"));
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  dem("b.asc", 4);
  text("all/tabled.toml", "files = [\"../b.asc\"]\n");
  load(toml);
  const auto tabled = catalog_.find("tabled");
  ASSERT_TRUE(tabled);
  text("all/tabled.toml", "# of the survey\nfiles = [\"../b.asc\"]\n");
  std::this_thread::sleep_for(CatalogFolder::kRest);  // it was another a moment ago
  load(toml);
  std::this_thread::sleep_for(CatalogFolder::kRest + 100ms);
  load(toml);
  EXPECT_EQ(catalog_.find("tabled"), tabled);
  text("all/tabled.toml", "# of the survey\nfiles = [\"../b.asc\"]\nmax_error = 7\n");
  EXPECT_THAT(load(toml).replaced, ElementsAre("tabled"));
}

TEST_F(Keeper, ANameThatIsTakenSaysByWhom) {
  fs::create_directories(in_folder("all"));
  dem("all/alpha.asc", 1);
  dem("b.asc", 4);
  text("all/beta.toml", "name = \"alpha\"\nfiles = [\"../b.asc\"]\n");
  load("catalog = \"" + in_folder("all") + "\"\n");
  EXPECT_THAT(names(), ElementsAre("alpha"));
  const auto aside = keeper_.status().aside;
  ASSERT_EQ(aside.size(), 1u);
  EXPECT_THAT(aside.begin()->second, HasSubstr(in_folder("all/alpha.asc")));
}

TEST_F(Keeper, ANewcomerTakesNobodysNameAndGetsItWhenItIsFree) {
  fs::create_directories(in_folder("all"));
  dem("b.asc", 4);
  text("all/land.toml", "files = [\"../b.asc\"]\n");
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  load(toml);
  const auto first = catalog_.find("land");
  ASSERT_TRUE(first);
  dem("all/land.asc", 9);  // which comes first in the folder
  load(toml);
  EXPECT_EQ(catalog_.find("land"), first);
  EXPECT_EQ(keeper_.status().aside.count(in_folder("all/land.asc")), 1u);

  // Nobody asks for a reload: it is seen.
  std::jthread running([this](const std::stop_token& stop) { keeper_.run(stop); });
  fs::remove(in_folder("all/land.toml"));
  for (int i = 0; i < 200 && (!catalog_.find("land") || height("land") != 9); ++i)
    std::this_thread::sleep_for(50ms);
  ASSERT_TRUE(catalog_.find("land"));
  EXPECT_EQ(height("land"), 9);
  for (int i = 0; i < 100 && !keeper_.status().aside.empty(); ++i)
    std::this_thread::sleep_for(50ms);
  EXPECT_THAT(keeper_.status().aside, IsEmpty());
}

TEST(NamedFiles, AreThoseOfLayersTooWhoseSettingsAreCalledAsInAFile) {
  const SettingTexts of_layer = {{"from_datum", "a.tif"}, {"to_datum", "ellipsoid"}};
  EXPECT_THAT(named_geoids(of_layer), ElementsAre("a.tif"));
  const SettingTexts own = {{"water", "sea.gpkg"}, {"drape", "c.tif"}};
  EXPECT_THAT(named_files({}, own), ElementsAre("sea.gpkg", "c.tif"));
  EXPECT_THAT(named_files({}, {{"from-datum", "none.gtx"}}), ElementsAre("none.gtx"));
}

TEST_F(Keeper, ATableWhoseFileComesLaterIsOpenedThen) {
  fs::create_directories(in_folder("all"));
  dem("b.asc", 4);
  text("all/a.toml",
       "files = [\"../b.asc\"]\nfrom_datum = \"../geoid.gtx\"\nto_datum = \"ellipsoid\"\n");
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  EXPECT_THAT(load(toml).aside, testing::SizeIs(1));
  EXPECT_THAT(keeper_.status().aside.begin()->second, HasSubstr("geoid.gtx"));
  test::write_gtx(
      in_folder("geoid.gtx"), [](double, double) { return 10; }, 8);
  EXPECT_THAT(load(toml).added, ElementsAre("a")) << keeper_.status().aside.begin()->second;
  EXPECT_EQ(height("a"), 14);
  EXPECT_THAT(keeper_.status().aside, IsEmpty());
}

TEST_F(Keeper, AReloadTakesTablesAsTheyAreAndSaysWhatItLeft) {
  fs::create_directories(in_folder("all"));
  dem("b.asc", 4);
  text("all/a.toml", "files = [\"../b.asc\"]\n");
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  load(toml);
  std::ofstream(in_folder("all/a.toml")) << "files = [\"../b.asc\"]\nmax_error = 7\n";
  EXPECT_THAT(load(toml).replaced, ElementsAre("a"));  // at once
  std::ofstream(in_folder("all/a.toml")) << "bogus = 1\n";
  const CatalogChange broken = load(toml);
  EXPECT_EQ(broken.kept, 1u);
  ASSERT_EQ(broken.aside.count(in_folder("all/a.toml")), 1u);
  EXPECT_THAT(broken.aside.at(in_folder("all/a.toml")), HasSubstr("bogus"));
  test::write_flat_dem(in_folder("all/young.asc"), 3);
  EXPECT_THAT(load(toml).waiting, testing::Contains(in_folder("all/young.asc")));
}

/// What a decoder does from its beginning is what this script says just then.
class Script {
 protected:
  Script() { decoders(kReal); }
  void decoders(const std::string& what) {
    std::ofstream(place_.file("next")) << what << '\n';
    fs::rename(place_.file("next"), place_.file("decoder"));
  }
  std::shared_ptr<SourcePool> pool() const {
    return sandboxed_pool({}, {.command = {"/bin/sh", place_.file("decoder")}, .nursery = {}});
  }
  const std::string kReal = "exec '" + test::tind_binary() + "' " + kDecoderArgument;
  const std::string kKilled = "kill -KILL $$", kCrashes = "kill -SEGV $$";

 private:
  test::TempDir place_;
};

class KeeperWithDecoders : Script, public Keeper {
 protected:
  KeeperWithDecoders() : Keeper(pool()) {
    fs::create_directories(in_folder("all"));
    toml_ = "catalog = \"" + in_folder("all") + "\"\n";
  }
  using Script::decoders, Script::kReal, Script::kKilled, Script::kCrashes;

  /// Within half a minute.
  template <class Condition>
  static bool comes(Condition&& condition) {
    for (int i = 0; i < 600 && !condition(); ++i) std::this_thread::sleep_for(50ms);
    return condition();
  }
  bool waits(const std::string& entry) const {
    return keeper_.status().again.contains(in_folder(entry));
  }

  std::string toml_;
};

TEST_F(KeeperWithDecoders, WhatMayPassIsTriedAgain) {
  dem("all/a.asc", 7);
  decoders(kKilled);
  EXPECT_THAT(load(toml_).aside, testing::SizeIs(1));
  EXPECT_THAT(names(), IsEmpty());
  EXPECT_TRUE(waits("all/a.asc"));
  const auto why = keeper_.status().aside[in_folder("all/a.asc")];
  EXPECT_THAT(why, HasSubstr("ended by signal 9"));
  EXPECT_EQ(why.find("tried again"), std::string::npos) << "that is said by who shows it";

  std::jthread running([this](const std::stop_token& stop) { keeper_.run(stop); });
  decoders(kReal);
  ASSERT_TRUE(comes([&] { return catalog_.find("a") != nullptr; }));
  EXPECT_EQ(height("a"), 7);
  EXPECT_TRUE(comes([&] { return keeper_.status().aside.empty(); }));
  EXPECT_THAT(keeper_.status().again, IsEmpty());
}

TEST_F(KeeperWithDecoders, TheNewContentOfAFileIsTriedAgainAndTheOldOneStaysUntilThen) {
  dem("all/a.asc", 1);
  load(toml_);
  const auto old = catalog_.find("a");
  ASSERT_TRUE(old);
  decoders(kKilled);
  dem("all/a.asc", 2);
  std::jthread running([this](const std::stop_token& stop) { keeper_.run(stop); });
  ASSERT_TRUE(comes([&] { return waits("all/a.asc"); }));
  EXPECT_EQ(catalog_.find("a"), old);
  decoders(kReal);
  ASSERT_TRUE(comes([&] { return catalog_.find("a") != old; }));
  EXPECT_EQ(height("a"), 2);
}

/// The decoder crashed at it, and would again.
TEST_F(KeeperWithDecoders, WhatLiesInTheFilesIsNotTriedAgain) {
  text("all/words.tif", "no raster at all");
  dem("all/a.asc", 7);
  load(toml_);
  EXPECT_THAT(names(), ElementsAre("a"));
  EXPECT_THAT(keeper_.status().aside, testing::SizeIs(1));
  EXPECT_THAT(keeper_.status().again, IsEmpty());
  dem("all/b.asc", 8);
  decoders(kCrashes);
  load(toml_);
  EXPECT_THAT(keeper_.status().aside[in_folder("all/b.asc")], HasSubstr("ended by signal 11"));
  EXPECT_THAT(keeper_.status().again, IsEmpty());
}

/// Whatever was found while it went: here a crash, for which nothing would be tried again.
TEST_F(KeeperWithDecoders, OfAFolderThatIsThereAgainAllIsTriedAgain) {
  dem("all/a.asc", 7);
  decoders(kCrashes);
  load(toml_);
  ASSERT_THAT(keeper_.status().aside, testing::SizeIs(1));
  ASSERT_THAT(keeper_.status().again, IsEmpty());
  std::jthread running([this](const std::stop_token& stop) { keeper_.run(stop); });
  fs::rename(in_folder("all"), in_folder("away"));
  ASSERT_TRUE(comes([&] { return keeper_.status().lost.has_value(); }));
  decoders(kReal);
  fs::rename(in_folder("away"), in_folder("all"));
  ASSERT_TRUE(comes([&] { return catalog_.find("a") != nullptr; }));
  EXPECT_TRUE(comes([&] { return keeper_.status().aside.empty(); }));
}

TEST_F(Keeper, AGeoidIsNoDataset) {
  fs::create_directories(in_folder("all"));
  dem("all/a.asc", 1);
  fs::copy_file(test::testdata("rainier.tif"), in_folder("all/ours.tif"));
  fs::last_write_time(in_folder("all/ours.tif"), fs::file_time_type::clock::now() - 1h);
  const std::string toml = "catalog = \"" + in_folder("all") + "\"\n";
  load(toml);
  EXPECT_THAT(names(), ElementsAre("a", "ours"));
  text("all/b.toml", "files = [\"../none.asc\"]\nfrom_datum = \"ours.tif\"\n");
  load(toml);
  EXPECT_THAT(names(), ElementsAre("a"));
}

TEST_F(Keeper, ATableOfTilesSaysNothingOfDems) {
  fs::create_directories(in_folder("tiles"));
  text("tiles/layer.json",
       R"({"format":"quantized-mesh-1.0","tiles":["{z}/{x}/{y}.terrain"],"available":[]})");
  load(table("t", "tiles", "attribution = \"me\"\n"));
  EXPECT_EQ(why_, "");
  load(table("t", "tiles", "max_error = 3\nfrom_datum = \"egm96\"\n"));
  EXPECT_THAT(why_, HasSubstr("from_datum, max_error"));
}

TEST(Opener, OneThatTakesLongHoldsUpNoOther) {
  std::atomic<bool> end = false;
  std::atomic<int> open = 0;
  {
    Opener opener(2);
    opener.begin("slow", [&]() -> Result<Dataset> {
      while (!end) std::this_thread::yield();
      return fail(Errc::io, "slow");
    });
    for (int i = 0; i < 20; ++i)
      opener.begin(std::to_string(i), [&]() -> Result<Dataset> {
        ++open;
        return Dataset{};
      });
    opener.begin("0", [&]() -> Result<Dataset> { return fail(Errc::internal, "again"); });
    opener.begin("thrown", []() -> Result<Dataset> { throw std::runtime_error("why"); });
    while (open < 20) std::this_thread::yield();
    opener.wait_until(Opener::Clock::now() + 10ms);  // in vain: one is slow
    EXPECT_FALSE(opener.take("slow"));
    EXPECT_TRUE(opener.take("0")->has_value());
    EXPECT_FALSE(opener.take("0"));
    opener.keep({"1", "slow"});
    EXPECT_TRUE(opener.take("1"));
    EXPECT_FALSE(opener.take("2"));
    end = true;
    opener.wait_until(Opener::Clock::now() + 1min);
    EXPECT_EQ(opener.take("slow")->error().what, "slow");
    opener.begin("thrown again", []() -> Result<Dataset> { throw std::runtime_error("why"); });
    opener.wait_until(Opener::Clock::now() + 1min);
    EXPECT_EQ(opener.take("thrown again")->error().what, "why");
  }
}

TEST(CatalogFolder, AStartWaitsForWhatWasJustPutThereButNotForEver) {
  const test::TempDir folder;
  test::write_flat_dem(folder.file("new.asc"), 1);
  wait_for_rest(folder.path().string(), 1min);
  const auto entries = CatalogFolder(folder.path().string()).look();
  ASSERT_TRUE(entries && entries->size() == 1);
  EXPECT_TRUE(entries->front().rests);
  fs::last_write_time(folder.file("new.asc"), fs::file_time_type::clock::now() + 24h);
  wait_for_rest(folder.path().string(), 0s);    // of another machine's clock
  wait_for_rest(folder.file("nothing"), 1min);  // which the load complains of
}

TEST(CatalogFolder, ALinkToRawNumbersElsewhereIsNoRaster) {
  const test::TempDir elsewhere, folder;
  std::ofstream(elsewhere.file("secret")) << "whatever it is, it would be heights";
  std::ofstream(folder.file("own.bil")) << "0123";
  std::filesystem::create_symlink(elsewhere.file("secret"), folder.file("leak.bil"));
  std::filesystem::create_symlink("own.bil", folder.file("same.bil"));
  std::filesystem::create_symlink(elsewhere.file("secret"), folder.file("dem.tif"));
  std::filesystem::create_directory(folder.file("mosaic"));
  std::filesystem::create_symlink(elsewhere.file("secret"), folder.file("mosaic/leak.flt"));
  const auto entries = CatalogFolder(folder.path()).look(false, {});
  ASSERT_TRUE(entries);
  std::map<std::string, bool> refused;
  for (const FolderEntry& entry : *entries)
    refused[entry.spec.name] = entry.wrong.find("a link to raw numbers") != std::string::npos;
  EXPECT_EQ(
      refused,
      (std::map<std::string, bool>{
          {"dem", false}, {"leak", true}, {"mosaic", true}, {"own", false}, {"same", false}}));
}

TEST(CatalogFolder, ARasterIsAnotherOneWhereAFileComesThatSaysMoreOfIt) {
  const test::TempDir folder;
  std::ofstream(folder.file("d.asc")) << "ncols 2";
  CatalogFolder catalog(folder.path());
  std::string before = catalog.look(false, {})->at(0).state;
  for (const char* beside : {"d.prj", "d.asc.msk"}) {
    std::ofstream(folder.file(beside)) << "more";
    const std::string now = catalog.look(false, {})->at(0).state;
    EXPECT_NE(now, before) << beside;
    before = now;
  }
  for (const char* other : {"d.txt", "d.asc.ovr"}) {
    std::ofstream(folder.file(other)) << "nothing that is read";
    EXPECT_EQ(catalog.look(false, {})->at(0).state, before) << other;
  }
}

TEST(CatalogFolder, WaitsForWhatIsStillWritten) {
  const test::TempDir folder;
  const auto write = [&](const std::string& text) {
    std::ofstream(folder.file("a.asc"), std::ios::app) << text;
  };
  CatalogFolder catalog(folder.path().string());
  const auto start = CatalogFolder::Clock::now();
  const auto rests = [&](std::chrono::milliseconds after) {
    const auto entries = catalog.look(false, start + after);
    EXPECT_TRUE(entries);
    EXPECT_EQ(entries->size(), 1u);
    return entries->at(0).rests;
  };
  write("x");
  EXPECT_FALSE(rests(0ms));
  EXPECT_FALSE(rests(1500ms));
  write("y");
  EXPECT_FALSE(rests(2500ms));
  EXPECT_FALSE(rests(4000ms));
  EXPECT_TRUE(rests(4500ms));
  // Replaced by one that is old: all the same, since it was another a moment ago.
  std::ofstream(folder.file(".b")) << "z";
  fs::last_write_time(folder.file(".b"), fs::file_time_type::clock::now() - 1h);
  fs::rename(folder.file(".b"), folder.file("a.asc"));
  EXPECT_FALSE(rests(5000ms));
  EXPECT_TRUE(rests(7000ms));
}

TEST(AdminListen, IsOfThisMachineAlone) {
  EXPECT_EQ(parse_admin_listen("127.0.0.1:81")->port, 81);
  EXPECT_EQ(parse_admin_listen("[::1]:81")->address, "::1");
  EXPECT_EQ(parse_admin_listen("unix:/run/t.sock")->socket, "/run/t.sock");
  for (const std::string bad : {"0.0.0.0:81", "10.0.0.1:81", "unix:", "", "[::]:81", "x"})
    EXPECT_FALSE(parse_admin_listen(bad)) << bad;
  EXPECT_FALSE(parse_admin_listen("unix:/" + std::string(103, 'a')));
}

}  // namespace
}  // namespace tind::services
