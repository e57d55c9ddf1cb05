// Many heights at once are those that height_at() says one by one.

#include "terrain/analysis/heights_at.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

constexpr double kSpacing = 0.01;

/// 300 x 200 posts with voids here and there: several of the squares that are read together.
HeightGrid rough_grid(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> height(0, 1000);
  HeightGrid grid(300, 200);
  for (float& z : grid.values()) z = random() % 20 == 0 ? HeightGrid::kVoid : height(random);
  return grid;
}

std::shared_ptr<const DemSource> source_of(HeightGrid grid) {
  return std::make_shared<test::MadeUpSource>(std::move(grid), Geographic{10, 50}, kSpacing);
}

Geographic place_of_post(double col, double row) {
  return {10 + col * kSpacing, 50 - row * kSpacing};
}

/// Inside, on posts and on edges of cells, outside, in no order.
std::vector<Geographic> places_over(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> col(-5, 305), row(-5, 205);
  std::vector<Geographic> places;
  for (int i = 0; i < count; ++i) {
    double c = col(random), r = row(random);
    if (i % 4 == 0) c = std::round(c);
    if (i % 6 == 0) r = std::round(r);
    places.push_back(place_of_post(c, r));
  }
  return places;
}

HeightAt one_of(const Surface& surface, Geographic place, Interpolation how) {
  const auto heights = heights_at(surface, {&place, 1}, how);
  EXPECT_TRUE(heights) << heights.error().what;
  return heights ? (*heights)[0].height : HeightAt{};
}

TEST(HeightsAt, AreThoseOfHeightAt) {
  const Surface surface(source_of(rough_grid(1)));
  const auto places = places_over(2, 5000);
  const auto heights = heights_at(surface, places, Interpolation::bilinear);
  ASSERT_TRUE(heights);
  int of[3] = {0, 0, 0};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto one = height_at(surface, places[i]);
    ASSERT_TRUE(one);
    EXPECT_EQ((*heights)[i].height.coverage, one->height.coverage) << i;
    EXPECT_EQ((*heights)[i].height.height_m, one->height.height_m) << i;
    ++of[int(one->height.coverage)];
  }
  for (const int n : of) EXPECT_GT(n, 100) << "values, voids and places outside";
}

TEST(HeightsAt, OfLayersAreThoseOfHeightAt) {
  auto city = std::make_shared<test::MadeUpSource>(rough_grid(4), Geographic{10.7, 49.6}, 0.002);
  const auto surface = Surface::of_layers(
      {{.name = "land", .source = source_of(rough_grid(3))}, {.name = "city", .source = city}});
  ASSERT_TRUE(surface) << surface.error().what;
  const auto places = places_over(5, 3000);
  const auto heights = heights_at(*surface, places, Interpolation::bilinear);
  ASSERT_TRUE(heights);
  int upper = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto one = height_at(*surface, places[i]);
    ASSERT_TRUE(one);
    EXPECT_EQ((*heights)[i].height.coverage, one->height.coverage) << i;
    EXPECT_EQ((*heights)[i].height.height_m, one->height.height_m) << i;
    const bool value = one->height.coverage == Coverage::value;
    EXPECT_EQ(value ? (*heights)[i].layer : 0, value ? one->layer : 0) << i;
    upper += (*heights)[i].layer == 1;
  }
  EXPECT_GT(upper, 50);
}

TEST(HeightsAt, NearestIsThePostThatIsNearest) {
  const HeightGrid grid = rough_grid(6);
  const Surface surface(source_of(grid));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> off(-0.49, 0.49);
  for (int i = 0; i < 500; ++i) {
    const int col = 1 + int(random() % 298), row = 1 + int(random() % 198);
    const HeightAt height = one_of(surface, place_of_post(col + off(random), row + off(random)),
                                   Interpolation::nearest);
    if (grid.is_void(col, row)) {
      EXPECT_EQ(height.coverage, Coverage::void_);
    } else {
      EXPECT_EQ(height.height_m, grid.at(col, row));
    }
  }
}

/// Keys' convolution with a = -1/2 gives back every quadratic, away from the grid's edges.
TEST(HeightsAt, CubicGivesQuadraticsBack) {
  HeightGrid grid(40, 30);
  const auto f = [](double x, double y) { return 3 + 2 * x - y + 0.5 * x * x - 0.25 * y * y; };
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c) grid.at(c, r) = float(f(c, r));
  const Surface surface(source_of(grid));
  std::mt19937 random(8);
  std::uniform_real_distribution<double> col(1, 38), row(1, 28);
  for (int i = 0; i < 300; ++i) {
    const double c = col(random), r = row(random);
    EXPECT_NEAR(one_of(surface, place_of_post(c, r), Interpolation::cubic).height_m, f(c, r), 1e-6);
  }
}

TEST(HeightsAt, CubicIsBilinearWhereAPostIsMissing) {
  HeightGrid grid = rough_grid(9);
  const Surface surface(source_of(grid));
  const Geographic at_the_edge = place_of_post(0.25, 100.5);
  EXPECT_EQ(one_of(surface, at_the_edge, Interpolation::cubic).height_m,
            one_of(surface, at_the_edge, Interpolation::bilinear).height_m);
}

TEST(HeightsAt, TellsThatTheSourceFails) {
  auto source = std::make_shared<test::MadeUpSource>(rough_grid(10), Geographic{10, 50}, kSpacing);
  source->reads_left = 1;
  const auto heights = heights_at(Surface(source), places_over(11, 1000), Interpolation::bilinear);
  ASSERT_FALSE(heights);
  EXPECT_EQ(heights.error().code, Errc::io);
}

TEST(HeightsAt, StopsWhenTold) {
  std::stop_source stop;
  stop.request_stop();
  const auto heights = heights_at(Surface(source_of(rough_grid(12))), places_over(13, 10),
                                  Interpolation::bilinear, stop.get_token());
  ASSERT_FALSE(heights);
  EXPECT_EQ(heights.error().code, Errc::cancelled);
}

}  // namespace
}  // namespace tind
