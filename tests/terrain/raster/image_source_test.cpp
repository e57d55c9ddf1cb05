#include "terrain/raster/gdal/image_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/support/support.h"

namespace tind {
namespace {

TEST(DrapeImage, ReprojectsOntoThePostsAndStretchesWithoutACrs) {
  TIND_NEEDS_SHARED_DATA(dem_path, "dem/rmnp-dem.tif");
  TIND_NEEDS_SHARED_DATA(image_path, "dem/rmnp-rgb.tif");
  const auto dem = DemSource::open(std::vector<std::string>{dem_path});
  ASSERT_TRUE(dem) << dem.error().what;
  const auto drape = drape_image(image_path, **dem);
  ASSERT_TRUE(drape) << drape.error().what;
  EXPECT_TRUE(drape->by_coordinates);
  EXPECT_GT(drape->covered, 0.99);
  EXPECT_EQ(drape->colours.size(), std::size_t((*dem)->info().cols * (*dem)->info().rows));
  const auto [low, high] = std::ranges::minmax(drape->colours);
  EXPECT_NE(low, high);
}

TEST(DrapeImage, SaysWhatIsWrong) {
  TIND_NEEDS_SHARED_DATA(dem_path, "dem/rmnp-dem.tif");
  TIND_NEEDS_SHARED_DATA(elsewhere, "dem/autzen_rgb_3ft_epsg2994.tif");
  const auto dem = DemSource::open(std::vector<std::string>{dem_path});
  ASSERT_TRUE(dem);
  EXPECT_EQ(drape_image(elsewhere, **dem).error().code, Errc::bad_data);
  test::TempDir folder;
  std::ofstream(folder.file("x.png")) << "no image";
  const auto broken = drape_image(folder.file("x.png"), **dem);
  ASSERT_FALSE(broken);
  EXPECT_NE(broken.error().what.find("x.png"), std::string::npos);
}

}  // namespace
}  // namespace tind
