// What cannot be served, and what is said of it.

#include "server/services/datasets/open_dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "terrain/pyramid/build/build.h"
#include "terrain/raster/draped.h"
#include "tests/support/globe_raster.h"
#include "tests/support/support.h"

namespace tind::services {
namespace {

using testing::HasSubstr;

TEST(OpenDataset, AMeshIsNamedAsOne) {
  test::TempDir folder;
  for (const char* const name : {"alps.ply", "alps.OBJ", "alps.dxf"}) {
    const std::string path = folder.file(name);
    std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const auto dataset = open_dataset({"alps", {path}}, {});
    ASSERT_FALSE(dataset);
    EXPECT_EQ(dataset.error().code, Errc::unsupported) << dataset.error().what;
    EXPECT_THAT(dataset.error().what, HasSubstr(path));
    EXPECT_THAT(dataset.error().what, HasSubstr("/processes/"));
  }
  // What is neither is what it was before; so is what is not there.
  std::ofstream(folder.file("notes.txt")) << "nothing\n";
  EXPECT_EQ(open_dataset({"notes", {folder.file("notes.txt")}}, {}).error().code, Errc::bad_data);
  EXPECT_EQ(open_dataset({"none", {folder.file("none.ply")}}, {}).error().code, Errc::not_found);
}

TEST(OpenDataset, AnImageThatIsReplacedIsAChange) {
  test::TempDir folder;
  DatasetOptions options;
  options.drape = test::globe_raster(folder, '\x80');
  const auto dataset = open_dataset({"rainier", {test::testdata("rainier.tif")}}, options);
  ASSERT_TRUE(dataset) << dataset.error().what;
  ASSERT_TRUE(dataset->unchanged);
  EXPECT_TRUE(dataset->unchanged());
  test::globe_raster(folder, '\x20');
  const auto changed = dataset->unchanged();
  ASSERT_FALSE(changed);
  EXPECT_THAT(changed.error().what, HasSubstr(options.drape));
}

/// What nobody would see anything of is a slip of the pen, of a DEM and of tiles alike.
TEST(OpenDataset, WhatIsDrapedLiesOnTheTerrain) {
  test::TempDir folder;
  const std::string here = test::place_raster(folder, "here", -122, 47, 0.05, '\x40'),
                    elsewhere = test::place_raster(folder, "elsewhere", 7, 47, 0.05, '\x40');
  const std::string dem = test::testdata("rainier.tif"), tiles = folder.file("tiles");
  {
    const auto source = DemSource::open(std::vector{dem});
    ASSERT_TRUE(source);
    BuildOptions few;
    few.output = tiles;
    few.tiles.max_level = 3, few.threads = 1;
    ASSERT_TRUE(build_tiles(*source, few));
  }
  for (const std::string& files : {dem, tiles})
    for (std::string DatasetOptions::*which :
         {&DatasetOptions::drape, &DatasetOptions::land_cover}) {
      DatasetOptions options;
      options.*which = here;
      const auto on = open_dataset({"rainier", {files}}, options);
      EXPECT_TRUE(on) << on.error().what;
      options.*which = elsewhere;
      const auto beside = open_dataset({"rainier", {files}}, options);
      ASSERT_FALSE(beside) << files;
      EXPECT_EQ(beside.error().code, Errc::invalid_argument);
      EXPECT_THAT(beside.error().what, HasSubstr(elsewhere));
    }
}

TEST(OpenDataset, WhatIsDrapedMayLieAcrossTheAntimeridian) {
  test::TempDir folder;
  const std::string west = test::place_raster(folder, "west", -180, 1, 0.05, '\x40');
  const auto draped = open_draped(west, "");
  ASSERT_TRUE(draped) << draped.error().what;
  EXPECT_TRUE(check_lies_on({179, 0, 181, 1}, *draped, west, ""));
  EXPECT_TRUE(check_lies_on({-181, 0, -179, 1}, *draped, west, ""));
  EXPECT_FALSE(check_lies_on({177, 0, 179, 1}, *draped, west, ""));
}

}  // namespace
}  // namespace tind::services
