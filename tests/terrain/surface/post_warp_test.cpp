#include "terrain/surface/post_warp.h"

#include <gtest/gtest.h>

#include <cmath>

#include "terrain/geo/ellipsoid.h"
#include "tests/support/counted_source.h"
#include "tests/support/projected_dem.h"

namespace tind {
namespace {

using test::ProjectedDem;

class PostWarp : public testing::TestWithParam<ProjectedDem> {
 protected:
  test::TempDir folder_;
};

TEST_P(PostWarp, places_every_post_where_proj_does_whatever_the_window) {
  const ProjectedDem& dem = GetParam();
  const auto source = test::open_projected(dem, folder_);
  ASSERT_TRUE(source);
  const auto all = post_positions(*source, 0, 0, dem.cols, dem.rows);
  std::vector<Vec2> posts;
  for (int r = 0; r < dem.rows; ++r)
    for (int c = 0; c < dem.cols; ++c) posts.push_back({double(c), double(r)});
  std::vector<Geographic> truth(posts.size());
  source->to_geographic(posts, truth);
  double worst = 0;
  for (std::size_t k = 0; k < posts.size(); ++k) {
    ASSERT_GE(all[k].lon, -180);
    ASSERT_LT(all[k].lon, 180);
    worst = std::max(worst, length(wgs84::to_ecef(all[k], 0) - wgs84::to_ecef(truth[k], 0)));
  }
  EXPECT_LT(worst, 1e-6);
  for (const int step : {1, 3, 50}) {
    const int col = 7, row = 51, cols = (dem.cols - 1 - col) / step + 1,
              rows = (dem.rows - 1 - row) / step + 1;
    const auto some = post_positions(*source, col, row, cols, rows, step);
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < cols; ++i)
        ASSERT_EQ(some[std::size_t(j) * cols + i],
                  all[std::size_t(row + j * step) * dem.cols + col + i * step])
            << "post " << col + i * step << ", " << row + j * step << ", step " << step;
  }
}

INSTANTIATE_TEST_SUITE_P(
    of_dems, PostWarp,
    testing::Values(ProjectedDem{"fine", "EPSG:32632", 400e3, 5100e3, 30, 140, 120},
                    ProjectedDem{"hundred_metres", "EPSG:2154", 700e3, 6600e3, 100, 140, 120},
                    ProjectedDem{"one_kilometre", "EPSG:3035", 4000e3, 3000e3, 1000, 140, 120},
                    ProjectedDem{"twenty_kilometres", "EPSG:3035", 2510e3, 4990e3, 20e3, 140, 120},
                    ProjectedDem{"south_pole", "EPSG:3031", -7e3, 6e3, 100, 140, 120},
                    ProjectedDem{"pole_on_a_post", "EPSG:3413", -70e3, 60e3, 1000, 140, 120},
                    ProjectedDem{"antimeridian", "EPSG:32760", 815e3, 8005e3, 100, 140, 120},
                    ProjectedDem{"seam", "EPSG:3832", -20e6, 6e6, 300e3, 140, 70}),
    [](const auto& dem) { return dem.param.name; });

/// Not by asking PROJ for every post.
TEST(PostWarpOfClosePosts, asks_proj_for_few) {
  const test::TempDir folder;
  for (const ProjectedDem& dem :
       {ProjectedDem{"inland", "EPSG:2154", 700e3, 6600e3, 100, 480, 480},
        ProjectedDem{"antimeridian", "EPSG:32760", 815e3, 8005e3, 100, 480, 480}}) {
    const auto source = test::open_projected(dem, folder);
    ASSERT_TRUE(source);
    const test::CountedSource counted(source);
    post_positions(counted, 0, 0, dem.cols, dem.rows);
    EXPECT_LT(counted.places_asked, 480 * 480 / 100) << dem.name;
  }
}

}  // namespace
}  // namespace tind
