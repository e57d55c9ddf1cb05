// Images as files: the bytes of on demand; going on where it was; never another's files, never a
// part taken for whole.

#include "terrain/images/image_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "terrain/base/file_io.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/images/height_image.h"
#include "terrain/images/mesh_image.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/store/folder/folder_lock.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf, ::testing::HasSubstr, ::testing::Not;

class ImageFolder : public ::testing::Test {
 protected:
  std::set<std::string> files() const {
    std::set<std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file()) all.insert(entry.path().lexically_relative(folder_).string());
    return all;
  }
  Result<ImageFolderReport> write(const ImageContent& content = proto::HeightCode::mapbox,
                                  bool force = false, const Surface* other = nullptr) {
    return write_images(images_of(other ? *other : surface_, {content, format_}), "dem",
                        {.output = folder_, .threads = 2, .force = force});
  }

  proto::ImageFormat format_ = proto::ImageFormat::png;
  Surface surface_ = std::make_shared<test::MadeUpSource>(test::rough_terrain(300, 250, 5),
                                                          Geographic{7.1, 45.9}, 4e-4);
  test::TempDir dir_;
  const std::string folder_ = dir_.file("images");
};

TEST_F(ImageFolder, HoldsTheBytesOfOnDemandAndNothingElse) {
  for (const ImageContent& content :
       {ImageContent(proto::HeightCode::terrarium), ImageContent(Shade{ShadeStyle::slope})}) {
    format_ =
        format_ == proto::ImageFormat::png ? proto::ImageFormat::webp : proto::ImageFormat::png;
    const auto report = write(content, true);
    ASSERT_TRUE(report) << report.error().what;
    std::uint64_t tiles = 0;
    for (const std::string& name : files()) {
      int z = 0, x = 0, y = 0;
      if (std::sscanf(name.c_str(), "%d/%d/%d.", &z, &x, &y) != 3) {
        EXPECT_TRUE(name == "tiles.json" || name == "tind-images.json") << name;
        continue;
      }
      ++tiles;
      const auto tile = web_mercator::tile(z, x, y);
      ASSERT_TRUE(tile && has_image(surface_, *tile)) << name;
      EXPECT_TRUE(name.ends_with("." + name_of(format_))) << name;
      EXPECT_EQ(*read_whole_file(folder_ + "/" + name),
                *image_file(surface_, {content, format_}, *tile))
          << name;
    }
    EXPECT_EQ(report->tiles, tiles);
    EXPECT_EQ(report->built, tiles);
    EXPECT_GT(tiles, std::uint64_t(deepest_image_level(surface_)));
  }
}

TEST_F(ImageFolder, GoesOnWhereItWas) {
  for (const std::string ending : {".png", ".webp"}) {
    format_ = *enum_named<proto::ImageFormat>(ending.substr(1));
    const auto first = write(proto::HeightCode::mapbox, true);
    ASSERT_TRUE(first);
    const auto whole = files();
    fs::remove(folder_ + "/tiles.json");  // as if it had been killed
    const std::string torn = folder_ + "/0/0/0" + ending, gone = folder_ + "/1/1/0" + ending;
    const std::string bytes = *read_whole_file(torn);
    std::ofstream(torn, std::ios::trunc) << bytes.substr(0, bytes.size() / 2);
    fs::remove(gone);
    const auto again = write();
    ASSERT_TRUE(again) << again.error().what;
    EXPECT_EQ(again->built, 2u);
    EXPECT_EQ(again->reused, first->tiles - 2);
    EXPECT_EQ(again->bytes, first->bytes);
    EXPECT_EQ(files(), whole);
    EXPECT_EQ(*read_whole_file(torn), bytes);
  }
}

TEST_F(ImageFolder, OfMeshesHoldsTheImagesOfTheTiles) {
  auto opened = open_dem_tiles(surface_, {});
  ASSERT_TRUE(opened) << opened.error().what;
  const std::shared_ptr<const TileSet> tiles = std::move(*opened);
  const int deepest = 9;
  const auto source = images_of(tiles, proto::HeightCode::terrarium, format_);
  const auto report =
      write_images(source, "dem", {.output = folder_, .last_level = deepest, .threads = 2});
  ASSERT_TRUE(report) << report.error().what;
  const LevelTiles ask{[&](TileId id) { return tiles->available(id); },
                       [&](TileId id, const std::stop_token& stop) {
                         return decode_tile(id, tiles->tile(id, stop)->bytes);
                       }};
  EXPECT_GT(report->tiles, std::uint64_t(deepest));
  for (const web_mercator::Tile tile : image_tiles(source, 0, deepest)) {
    const std::string name = std::to_string(tile.level) + "/" + std::to_string(tile.x) + "/" +
                             std::to_string(tile.y) + ".png";
    const auto image = mesh_image(ask, tile, kImagePixels);
    ASSERT_TRUE(image);
    EXPECT_EQ(*read_whole_file(folder_ + "/" + name),
              proto::encode_image(mesh_pixels(*image, proto::HeightCode::terrarium, tiles->layer()),
                                  format_))
        << name;
  }
  EXPECT_EQ(write(proto::HeightCode::terrarium).error().code, Errc::invalid_argument)
      << "images of the DEM itself are others";
}

TEST_F(ImageFolder, StopsAndHasNoTilesJson) {
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double) { stop.request_stop(); };
  const auto report = write_images(images_of(surface_, {proto::HeightCode::mapbox}), "dem",
                                   {.output = folder_, .threads = 1}, progress);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, Errc::cancelled);
  EXPECT_FALSE(fs::exists(folder_ + "/tiles.json"));
  EXPECT_TRUE(write());
}

TEST_F(ImageFolder, OfAnotherSourceIsRefusedOrReplacedWithoutARest) {
  ASSERT_TRUE(write());
  const Surface other = std::make_shared<test::MadeUpSource>(test::rough_terrain(60, 60, 5),
                                                             Geographic{-7.1, 45.9}, 4e-4);
  const auto before = files();
  EXPECT_EQ(write(ImageContent(Shade{})).error().code, Errc::invalid_argument);
  format_ = proto::ImageFormat::webp;
  EXPECT_EQ(write().error().code, Errc::invalid_argument);
  EXPECT_EQ(files(), before);
  std::ofstream(folder_ + "/mine.txt") << "x";
  const auto report = write(ImageContent(Shade{}), true, &other);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(files().size(), report->tiles + 3);
  EXPECT_TRUE(fs::exists(folder_ + "/mine.txt"));
}

TEST_F(ImageFolder, TakesAwayWhatItsRecordSaysAndNothingOfOthers) {
  const auto levels = [&](const ImageContent& content, int last, bool force) {
    return write_images(images_of(surface_, {content, format_}), "dem",
                        {.output = folder_, .last_level = last, .threads = 2, .force = force});
  };
  ASSERT_TRUE(levels(proto::HeightCode::mapbox, 3, false));
  const auto put = [&](const std::string& name, const std::string& bytes) {
    fs::create_directories(fs::path(folder_ + "/" + name).parent_path());
    std::ofstream(folder_ + "/" + name, std::ios::trunc) << bytes;
  };
  const auto has = [&](const std::string& name) {
    return read_whole_file(folder_ + "/" + name).value_or("");
  };
  const std::string whole = has("0/0/0.png");  // which would be taken for one of the build
  const std::string others[] = {"20/1/1.png",  "2/9/9.png",    "3/0/0.png",  "3/4/2.webp",
                                "3/04/2.png",  "5/0/0.png",    "9/1/1.png",  "0/0/0.jpg",
                                "3/4/2/2.png", "mine/4/2.png", "3/4/2.tiff", "99999999/0/0.png"};
  for (const std::string& name : others) put(name, whole);
  ASSERT_TRUE(has("4/8/5.png").empty());
  put("4/8/5.png", whole);    // in the place of one of more levels
  put("2/2/1.png.part", "");  // of a run that was killed
  const auto report = levels(ImageContent(Shade{}), 2, true);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->built, report->tiles);
  for (const std::string& name : others) EXPECT_EQ(has(name), whole) << name;
  EXPECT_EQ(has("4/8/5.png"), whole);
  EXPECT_FALSE(fs::exists(folder_ + "/3/4/2.png"));
  EXPECT_FALSE(fs::exists(folder_ + "/2/2/1.png.part"));
  const auto more = levels(ImageContent(Shade{}), 4, false);
  ASSERT_TRUE(more) << more.error().what;
  EXPECT_EQ(more->reused, report->tiles);
  EXPECT_EQ(has("4/8/5.png"),
            *image_file(surface_, {ImageContent(Shade{}), format_}, *web_mercator::tile(4, 8, 5)));
  for (const std::string& name : others) EXPECT_EQ(has(name), whole) << name;
}

TEST_F(ImageFolder, OfADamagedRecordIsMadeAnewAndTakesNoneForItsOwn) {
  const auto first = write();
  ASSERT_TRUE(first);
  std::ofstream(folder_ + "/tind-images.json", std::ios::trunc) << "{";
  const auto again = write(proto::HeightCode::mapbox, true);
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->built, first->tiles);
}

TEST_F(ImageFolder, SaysWhatIsOther) {
  ASSERT_TRUE(write());
  const auto refusal = [&](const ImageContent& content, const Surface* surface = nullptr) {
    const auto report = write(content, false, surface);
    return report ? std::string() : report.error().what;
  };
  EXPECT_THAT(
      refusal(proto::HeightCode::terrarium),
      AllOf(HasSubstr("mapbox, not terrarium"), HasSubstr("--force"), Not(HasSubstr("source"))));
  EXPECT_THAT(refusal(Shade{}), HasSubstr("mapbox, not hillshade"));
  const Surface other = std::make_shared<test::MadeUpSource>(
      test::rough_terrain(300, 250, 5), Geographic{7.1, 45.9}, 4e-4, 0, "another");
  EXPECT_THAT(refusal(proto::HeightCode::mapbox, &other), HasSubstr("source"));
  format_ = proto::ImageFormat::webp;
  EXPECT_THAT(refusal(proto::HeightCode::mapbox),
              AllOf(HasSubstr("png, not webp"), Not(HasSubstr("source"))));
  std::ofstream(folder_ + "/tind-images.json") << "{";
  EXPECT_THAT(refusal(proto::HeightCode::mapbox), HasSubstr("damaged"));
}

TEST_F(ImageFolder, GoesOnWhateverItsRecordSaysOfTheMiddle) {
  ASSERT_TRUE(write());
  const std::string path = folder_ + "/tind-images.json";
  std::string record = *read_whole_file(path);
  const auto at = record.find("\"center\":[");
  ASSERT_NE(at, record.npos);
  record.replace(at, 10, "\"center\":[9");  // as an earlier version reckoned it
  std::ofstream(path, std::ios::trunc) << record;
  const auto again = write();
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->built, 0u);
}

TEST_F(ImageFolder, LeavesNoEmptyFoldersOfAnotherDem) {
  ASSERT_TRUE(write());
  const Surface elsewhere = std::make_shared<test::MadeUpSource>(
      test::rough_terrain(30, 25, 6), Geographic{-70.1, -45.9}, 4e-4, 0, "another");
  fs::create_directories(folder_ + "/somebody/elses");
  ASSERT_TRUE(write(proto::HeightCode::mapbox, true, &elsewhere));
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    EXPECT_TRUE(!entry.is_directory() || !fs::is_empty(entry.path()) ||
                entry.path().filename() == "elses")
        << entry.path();
  EXPECT_TRUE(fs::exists(folder_ + "/somebody/elses"));
}

TEST_F(ImageFolder, RefusesALinkInTheWayBeforeItChangesAnything) {
  const Surface other = std::make_shared<test::MadeUpSource>(
      test::rough_terrain(300, 250, 6), Geographic{7.1, 45.9}, 4e-4, 0, "another");
  const auto write_few = [&](const Surface& surface, bool force) {
    return write_images(images_of(surface, {proto::HeightCode::mapbox, format_}), "dem",
                        {.output = folder_, .last_level = 3, .threads = 2, .force = force});
  };
  ASSERT_TRUE(write_few(surface_, false));
  const auto before = files();
  const std::string record = *read_whole_file(folder_ + "/tind-images.json");
  for (const std::string place : {"3", "3/4", "3/4/2.png"}) {
    const std::string at = folder_ + "/" + place, elsewhere = dir_.file("elsewhere");
    fs::rename(at, elsewhere);
    fs::create_symlink(elsewhere, at);
    for (const Surface& surface : {surface_, other}) {
      const auto refused = write_few(surface, true);
      ASSERT_FALSE(refused) << place;
      EXPECT_EQ(refused.error().code, Errc::invalid_argument);
      EXPECT_THAT(refused.error().what, HasSubstr(at + " is in the place of"));
    }
    EXPECT_TRUE(fs::is_symlink(at));
    fs::remove(at);
    fs::rename(elsewhere, at);
    EXPECT_EQ(files(), before) << place;
    EXPECT_EQ(*read_whole_file(folder_ + "/tind-images.json"), record);
  }
  fs::create_symlink("elsewhere", folder_ + "/20");  // deeper than any image: somebody else's
  const auto report = write_few(other, true);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->built, report->tiles);
  EXPECT_TRUE(fs::is_symlink(folder_ + "/20"));
}

TEST_F(ImageFolder, OfARecordThatCannotBeReadIsNotCalledAnothers) {
  fs::create_directories(folder_);
  ASSERT_EQ(::mkfifo((folder_ + "/tind-images.json").c_str(), 0666), 0);
  EXPECT_EQ(write(proto::HeightCode::mapbox, true).error().code, Errc::io);
}

TEST_F(ImageFolder, GoesOnFromAKillJustBeforeItsRecordWasThere) {
  fs::create_directories(folder_);
  const std::string left = folder_ + "/tind-images.json.partial-0123456789abcdef";
  std::ofstream(left) << "{";
  std::ofstream(left + "0") << "mine";  // no name that a run gives
  EXPECT_EQ(write().error().code, Errc::invalid_argument);
  EXPECT_TRUE(fs::exists(left));
  fs::remove(left + "0");
  const auto report = write();
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(ImageFolder, LeavesWhatIsNotItsOwnAndWaitsForNobody) {
  fs::create_directories(folder_);
  std::ofstream(folder_ + "/mine.txt") << "x";
  EXPECT_EQ(write(proto::HeightCode::mapbox, true).error().code, Errc::invalid_argument);
  EXPECT_EQ(files(), std::set<std::string>{"mine.txt"});
  fs::remove(folder_ + "/mine.txt");
  const auto lock = FolderLock::take(folder_);
  ASSERT_TRUE(lock);
  EXPECT_EQ(write().error().code, Errc::busy);
}

}  // namespace
}  // namespace tind
