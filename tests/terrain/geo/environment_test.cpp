#include "terrain/geo/environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(Environment, LoadsItsOwnGeoidOnce) {
  const auto environment = test::environment();
  const auto first = environment->egm96(), second = environment->egm96();
  ASSERT_TRUE(first && second) << (first ? "" : first.error().what);
  EXPECT_EQ(*first, *second);
  const Environment other(environment->data_dir());
  EXPECT_NE(*other.egm96(), *first) << "nothing is kept outside of it";
}

TEST(Environment, SaysWhereItLookedAndLooksAgain) {
  const test::TempDir folder;
  const Environment environment(folder.path().string());
  const auto none = environment.egm96();
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Errc::not_found);
  EXPECT_THAT(none.error().what, testing::AllOf(testing::HasSubstr(folder.file("geoids")),
                                                testing::HasSubstr("scripts/make_geoid")));
  std::filesystem::create_directory_symlink(test::environment()->data_dir() + "/geoids",
                                            folder.file("geoids"));
  EXPECT_TRUE(environment.egm96());
}

TEST(Environment, IsNeededOnlyWhereTheGeoidIs) {
  const std::vector<std::string> files = {test::testdata("rainier.tif")};
  EXPECT_TRUE(DemSource::open(files, {}));
  const auto without = DemSource::open(files, {.to_datum = TargetDatum::ellipsoid});
  ASSERT_FALSE(without);
  EXPECT_THAT(without.error().what, testing::HasSubstr("rainier.tif"));
  EXPECT_TRUE(DemSource::open(
      files, {.to_datum = TargetDatum::ellipsoid, .environment = test::environment()}));
}

}  // namespace
}  // namespace tind
