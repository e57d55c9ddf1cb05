// What cannot be served, and what is said of it.

#include "server/services/datasets/open_dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

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

}  // namespace
}  // namespace tind::services
