#include "terrain/dataset/dataset.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/store/open/stored_tiles.h"
#include "tests/support/made_up_source.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/projected_dem.h"
#include "tests/support/support.h"

namespace tind {
namespace {

std::shared_ptr<const test::MadeUpSource> ramp(float highest = 99) {
  HeightGrid grid(40, 30, 5);
  grid.at(7, 4) = highest, grid.at(30, 20) = -3;
  return std::make_shared<test::MadeUpSource>(std::move(grid), Geographic{-122, 47}, 0.01);
}

TEST(Dataset, OfTilesKnowsWhatTheirLayerSays) {
  const auto tiles = std::make_shared<test::MadeUpTiles>();
  const Dataset dataset = dataset_of(tiles);
  EXPECT_EQ(dataset.tiles, tiles);
  EXPECT_EQ(dataset.source, nullptr);
  EXPECT_EQ(dataset.facts().bounds, (GeoRect{-180, -90, 180, 90}));
  EXPECT_EQ(dataset.facts().datum, "") << "nobody says it";
  EXPECT_FALSE(dataset.facts().extremes);
  EXPECT_FALSE(dataset.renewed);
}

TEST(Dataset, HasABoxAcrossTheAntimeridian) {
  const test::TempDir folder;
  const std::shared_ptr<const DemSource> fiji = test::open_projected(
      {"fiji", "EPSG:32760", 760000, 8050000, 2000, 90, 60}, folder);  // 179.4 E .. 178.9 W
  ASSERT_TRUE(fiji);
  ASSERT_EQ(fiji->info().bounds.width(), 360);
  const auto dem = dem_dataset(fiji, {});
  ASSERT_TRUE(dem) << dem.error().what;
  const GeoRect box = dem->facts().box;
  EXPECT_GT(box.west, 179);
  EXPECT_GT(box.east, 180.5);
  EXPECT_LT(box.east, 182);
  EXPECT_EQ(box, dataset_of(fiji).facts().box);
  // Of its tiles alone, to a tile of the deepest level.
  const GeoRect of_tiles = dataset_of(dem->tiles).facts().box;
  const double tile = tiling::tile_degrees(dem->tiles->layer().maxzoom);
  EXPECT_NEAR(of_tiles.west, box.west, tile);
  EXPECT_NEAR(of_tiles.east, box.east, tile);
}

TEST(Dataset, HasABoxAroundTheEarthWhereOnlyAFineLayerIsSmall) {
  struct Town : test::MadeUpTiles {
    Town() {
      place_ = test::MadeUpTiles::layer();
      for (const std::uint32_t z : {5u, 6u})
        place_.available.push_back({{33u << (z - 5), 9, 35u << (z - 5), 12}});
      place_.maxzoom = 6;
    }
    const proto::LayerJson& layer() const override { return place_; }
    proto::LayerJson place_;
  };
  EXPECT_EQ(dataset_of(std::make_shared<Town>()).facts().box, (GeoRect{-180, -90, 180, 90}));
}

TEST(Dataset, OfASourceNeedsNoTiles) {
  const auto source = ramp();
  const Dataset dataset = dataset_of(source);
  ASSERT_TRUE(dataset.source);
  EXPECT_EQ(dataset.source->only(), source.get());
  EXPECT_EQ(dataset.tiles, nullptr);
  EXPECT_EQ(dataset.facts().bounds, source->info().bounds);
  EXPECT_EQ(dataset.facts().datum, "unknown");
}

TEST(Dataset, OfADemHasBothAndItsExtremes) {
  const auto source = ramp();
  const auto dataset = dem_dataset(source, {});
  ASSERT_TRUE(dataset) << dataset.error().what;
  ASSERT_TRUE(dataset->source);
  EXPECT_EQ(dataset->source->only(), source.get());
  ASSERT_TRUE(dataset->tiles);
  const DatasetFacts facts = dataset->facts();
  EXPECT_EQ(facts.datum, dataset->tiles->layer().datum);
  ASSERT_TRUE(facts.extremes);
  EXPECT_EQ(facts.extremes->highest.height_m, 99);
  EXPECT_NEAR(facts.extremes->highest.where.lon, -122 + 0.07, 1e-9);
  EXPECT_EQ(facts.extremes->lowest.height_m, -3);
  EXPECT_FALSE(dataset->renewed) << "a DEM that changes is refused, never opened anew";
}

TEST(Dataset, LearnsTheExtremesOnceALargeSourceIsRead) {
  const auto dataset = dem_dataset(ramp(), {}, {}, 0);
  ASSERT_TRUE(dataset) << dataset.error().what;
  const Dataset copy = *dataset;  // shares what it is made of
  while (copy.tiles->readiness().state == Readiness::State::reading)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_TRUE(copy.facts().extremes);
  EXPECT_EQ(copy.facts().extremes->highest.height_m, 99);
}

TEST(Dataset, SaysThatItsIndexCannotBeKept) {
  const test::TempDir folder;
  std::ofstream(folder.file("file")) << "not a folder";
  TileSetOptions options;
  options.exact_posts = 1 << 16;
  auto rainier = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  ASSERT_TRUE(rainier) << rainier.error().what;
  const auto dataset = dem_dataset(*rainier, options, folder.file("file/index"));
  ASSERT_FALSE(dataset);
  EXPECT_EQ(dataset.error().code, Errc::io);
  EXPECT_NE(dataset.error().what.find("cannot create"), std::string::npos);
}

class StoredDataset : public testing::Test {
 protected:
  void build(float highest) {
    BuildOptions o;
    o.output = folder_.file("tiles");
    o.threads = 1;
    const auto report = build_tiles(ramp(highest), o);
    ASSERT_TRUE(report) << report.error().what;
  }
  test::TempDir folder_;
};

TEST_F(StoredDataset, IsRenewedWhenItsRecordChanges) {
  build(99);
  const auto dataset = stored_dataset(folder_.file("tiles"));
  ASSERT_TRUE(dataset) << dataset.error().what;
  EXPECT_EQ(dataset->source, nullptr);
  EXPECT_EQ(dataset->facts().datum, "unknown");
  ASSERT_TRUE(dataset->renewed);
  EXPECT_FALSE(dataset->renewed());

  build(99);  // again: nothing to do
  EXPECT_FALSE(dataset->renewed());

  std::filesystem::remove_all(folder_.file("tiles"));
  EXPECT_FALSE(dataset->renewed()) << "what is gone is not another";
  build(150);
  const auto other = dataset->renewed();
  ASSERT_TRUE(other);
  EXPECT_NE(other->tiles->layer().version, dataset->tiles->layer().version);
  ASSERT_TRUE(other->renewed);
  EXPECT_FALSE(other->renewed());
}

TEST_F(StoredDataset, WithoutALedgerNeverChanges) {
  build(99);
  std::filesystem::remove(folder_.file("tiles/tind-tiles.ledger"));
  const auto dataset = stored_dataset(folder_.file("tiles"));
  ASSERT_TRUE(dataset) << dataset.error().what;
  EXPECT_FALSE(dataset->renewed);
}

TEST_F(StoredDataset, FailsAsItsTilesDo) {
  const auto none = stored_dataset(folder_.file("none"));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().what, open_stored_tiles(folder_.file("none")).error().what);
}

}  // namespace
}  // namespace tind
