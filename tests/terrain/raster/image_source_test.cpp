#include "terrain/raster/gdal/pictures/image_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "terrain/base/file_io.h"
#include "terrain/raster/raster_file.h"
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

TEST(DrapeImage, RefusesAPlaceThatIsNone) {
  const auto dem = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  const test::TempDir folder;
  const auto at = [&](const Affine& place) {
    DemInfo info = (*dem)->info();
    info.cols = info.rows = 4;
    info.post_to_crs = place;
    const auto image =
        encode_raster(RasterFormat::geotiff, info, {},
                      [](int, int rows) -> Result<HeightGrid> { return HeightGrid(4, rows, .5f); });
    EXPECT_TRUE(image && write_whole_file(folder.file("a.tif"), image->bytes));
    return drape_image(folder.file("a.tif"), **dem);
  };
  const auto good = at({-122, .2, .01, 47, .01, -.2});
  ASSERT_TRUE(good) << good.error().what;
  EXPECT_TRUE(good->by_coordinates);
  for (const double step : {.01, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
    const auto none = at({-122, step, .01, 47, .01, .01});  // 0.01: columns and rows are parallel
    ASSERT_FALSE(none) << step;
    EXPECT_EQ(none.error().code, Errc::bad_data) << none.error().what;
    EXPECT_NE(none.error().what.find("singular"), std::string::npos) << none.error().what;
  }
}

TEST(DrapeImage, IsWhiteWhereTheImageIsNot) {
  const auto dem = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  const DemInfo& all = (*dem)->info();
  const test::TempDir folder;
  DemInfo info = all;  // the western half, and of that the northern one is no data
  info.cols = all.cols / 2;
  info.has_geotransform = true;
  const auto image =
      encode_raster(RasterFormat::geotiff, info, {}, [&](int row, int rows) -> Result<HeightGrid> {
        HeightGrid grey(int(info.cols), rows, .25f);
        for (int r = 0; r < rows; ++r)
          if (row + r < all.rows / 2) std::ranges::fill(grey.row(r), HeightGrid::kVoid);
        return grey;
      });
  ASSERT_TRUE(image && write_whole_file(folder.file("a.tif"), image->bytes));
  const auto drape = drape_image(folder.file("a.tif"), **dem);
  ASSERT_TRUE(drape) << drape.error().what;
  EXPECT_NEAR(drape->covered, .25, .005);
  const auto at = [&](double x, double y) {
    return drape->colours[std::size_t(y * double(all.rows)) * std::size_t(all.cols) +
                          std::size_t(x * double(all.cols))];
  };
  EXPECT_NEAR(at(.25, .75)[1], .25, 1e-6);
  for (const auto& [x, y] : {std::pair(.75, .75), std::pair(.25, .25), std::pair(.99, .01)})
    EXPECT_EQ(at(x, y), (Colour{1, 1, 1})) << x << " " << y;
}

TEST(DrapeImage, OfAMuchLargerImageIsAsSharpAsOfItsPart) {
  const auto dem = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  const DemInfo& posts = (*dem)->info();
  const test::TempDir folder;
  // Stripes of four posts on an image of the posts' spacing, which reaches far beyond them.
  DemInfo info = posts;
  info.cols = 8 * posts.cols, info.rows = 8 * posts.rows;
  info.post_to_crs.x0 -= double(3 * posts.cols) * info.post_to_crs.x_col;
  info.post_to_crs.y0 -= double(3 * posts.rows) * info.post_to_crs.y_row;
  info.has_geotransform = true;
  const auto image =
      encode_raster(RasterFormat::geotiff, info, {}, [&](int, int rows) -> Result<HeightGrid> {
        HeightGrid grey(int(info.cols), rows, 0);
        for (int r = 0; r < rows; ++r)
          for (int c = 0; c < grey.cols(); ++c) grey.at(c, r) = c / 4 % 2 ? 1 : 0;
        return grey;
      });
  ASSERT_TRUE(image && write_whole_file(folder.file("a.tif"), image->bytes));
  const auto drape = drape_image(folder.file("a.tif"), **dem);
  ASSERT_TRUE(drape) << drape.error().what;
  EXPECT_EQ(drape->covered, 1);
  std::size_t pure = 0;
  for (const Colour& c : drape->colours) pure += c[0] < .01f || c[0] > .99f;
  EXPECT_GT(double(pure), .7 * double(drape->colours.size()));
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
