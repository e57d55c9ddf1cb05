#include "terrain/geo/geodesic_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "terrain/geo/ellipsoid.h"

namespace tind {
namespace {

TEST(GeodesicPath, lengths_as_published) {
  // A degree of the equator, and the quarter of a meridian of WGS84.
  const std::vector<Geographic> equator = {{0, 0}, {1, 0}, {3, 0}};
  const GeodesicPath along(equator);
  EXPECT_NEAR(along.reached_m()[1], wgs84::kSemiMajor * std::acos(-1) / 180, 1e-6);
  EXPECT_NEAR(along.length_m(), 3 * along.reached_m()[1], 1e-6);
  const std::vector<Geographic> meridian = {{7, 0}, {7, 90}};
  EXPECT_NEAR(GeodesicPath(meridian).length_m(), 10001965.7293, 1e-3);
}

TEST(GeodesicPath, places_lie_evenly_and_pass_the_given_ones) {
  const std::vector<Geographic> bent = {{179.9, 46}, {-179.9, 46.1}, {-179.9, 46.1}, {-179.5, 45}};
  const GeodesicPath way(bent);
  const auto even = way.evenly(11);
  ASSERT_EQ(even.size(), 11u);
  EXPECT_EQ(even.front(), bent.front());
  EXPECT_EQ(even.back(), bent.back());
  EXPECT_EQ(way.at(way.reached_m()[1]), bent[1]);
  EXPECT_EQ(way.at(-5), bent.front());
  EXPECT_EQ(way.at(1e9), bent.back());
  // Pieces that hold no corner are as long as their part of the way.
  for (std::size_t i = 1; i < even.size(); ++i) {
    const double from = way.length_m() * double(i - 1) / 10, to = way.length_m() * double(i) / 10;
    if (from < way.reached_m()[1] && to > way.reached_m()[1]) continue;
    const std::vector<Geographic> piece = {even[i - 1], even[i]};
    EXPECT_NEAR(GeodesicPath(piece).length_m(), to - from, 1e-6) << i;
  }
}

TEST(GeodesicPath, of_one_place_is_that_place) {
  const std::vector<Geographic> one = {{7, 46}};
  EXPECT_EQ(GeodesicPath(one).length_m(), 0);
  EXPECT_EQ(GeodesicPath(one).evenly(3), std::vector<Geographic>(3, one[0]));
}

TEST(GeodesicPath, beside_it_is_at_a_right_angle_and_so_far) {
  const std::vector<Geographic> way = {{7, 46}, {7.5, 46.2}, {7.5, 46.9}, {8, 46.9}};
  const GeodesicPath path(way);
  for (int i = 0; i <= 40; ++i)
    for (const double right : {-5000., -1., 3., 2000.}) {
      const double metres = path.length_m() * i / 40;
      const Geographic on = path.at(metres), beside = path.beside(metres, right);
      const auto apart = [](const Geographic& a, const Geographic& b) {
        return GeodesicPath(std::vector{a, b}).length_m();
      };
      EXPECT_NEAR(apart(on, beside), std::abs(right), 1e-6);
    }
  // Heading north, the right is in the east; heading east, in the south.
  const double north = (path.reached_m()[1] + path.reached_m()[2]) / 2;
  EXPECT_GT(path.beside(north, 10).lon, path.at(north).lon);
  EXPECT_LT(path.beside(path.length_m(), 10).lat, path.at(path.length_m()).lat);
  EXPECT_GT(path.beside(path.length_m(), -10).lat, path.at(path.length_m()).lat);
  // A place that is given twice has no direction of its own.
  const GeodesicPath twice(std::vector<Geographic>{{7, 46}, {7.1, 46}, {7.1, 46}});
  EXPECT_EQ(twice.reached_m().size(), 3u);
  EXPECT_LT(twice.beside(twice.length_m(), 1000).lat, 45.995);
}

}  // namespace
}  // namespace tind
