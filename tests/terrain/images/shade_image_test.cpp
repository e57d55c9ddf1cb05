// Hillshade, slope and aspect: a plane has the gradient that geometry says, tiles have no seam,
// parents are the means of their children, voids are left out.

#include "terrain/images/shade_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "terrain/geo/ellipsoid.h"
#include "terrain/images/height_image.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

constexpr Geographic kNorthWest = {7.01, 46.3};

web_mercator::Tile tile_at(int level, Geographic p) {
  const double side = std::ldexp(1.0, level);
  return *web_mercator::tile(level, std::int64_t(web_mercator::u_of(p.lon) * side),
                             std::int64_t(web_mercator::v_of(p.lat) * side));
}

/// Rises by `east` and `north` metres per degree.
Surface plane(double east, double north, double spacing = .0005, int posts = 300) {
  HeightGrid grid(posts, posts);
  for (int r = 0; r < posts; ++r)
    for (int c = 0; c < posts; ++c) grid.at(c, r) = float(c * spacing * east - r * spacing * north);
  return std::make_shared<MadeUpSource>(grid, kNorthWest, spacing);
}

TEST(Shades, OfAPlaneAreWhatGeometrySays) {
  const double degree = std::numbers::pi / 180;
  for (const double slope : {1., 20., 44.})
    for (const double aspect : {0., 37., 90., 200., 271., 359.}) {
      const Vec2 metres = wgs84::metres_per_degree(46.225);
      const double steep = std::tan(slope * degree);  // it falls towards the aspect
      const Surface surface = plane(-steep * std::sin(aspect * degree) * metres.x,
                                    -steep * std::cos(aspect * degree) * metres.y);
      const auto image = gradient_image(surface, tile_at(12, {7.085, 46.225}), 128);
      ASSERT_TRUE(image) << image.error().what;
      int seen = 0;
      for (std::size_t k = 0; k < image->east.size(); ++k) {
        if (image->empty(k)) continue;
        ++seen;
        // A degree is longer in the south than in the north of the plane.
        EXPECT_NEAR(slope_deg(image->east[k], image->north[k]), slope, .08);
        const double turn = aspect_deg(image->east[k], image->north[k]) - aspect;
        EXPECT_LT(std::abs(std::remainder(turn, 360)), .2) << aspect;
      }
      EXPECT_GT(seen, 1000);
    }
}

TEST(Shades, ArePictures) {
  const Shade light{.azimuth_deg = 270, .altitude_deg = 30};
  EXPECT_EQ(hillshade_grey(0, 0, light), 128);                               // half of 254, and 1
  EXPECT_EQ(hillshade_grey(std::tan(std::numbers::pi / 3), 0, light), 255);  // faces the light
  EXPECT_EQ(hillshade_grey(-2, 0, light), 1);
  EXPECT_EQ(hillshade_grey(.5, .2, {.z_factor = 3}), hillshade_grey(1.5, .6, {}));
  EXPECT_EQ(aspect_deg(0, -1), 0);
  EXPECT_EQ(aspect_deg(-1, 0), 90);
  EXPECT_EQ(aspect_deg(0, 1), 180);
  EXPECT_EQ(aspect_deg(1, 0), 270);
  EXPECT_LT(aspect_deg(1e-30, -1), 360);
  EXPECT_EQ(slope_deg(0, 1), 45);
  for (const ShadeStyle style : {ShadeStyle::hillshade, ShadeStyle::slope, ShadeStyle::aspect})
    EXPECT_EQ(shade_style_named(name(style)), style);
  EXPECT_FALSE(shade_style_named("relief"));
}

/// Two halves of the pixels on both sides of each edge are those of a tile that has both.
TEST(Shades, HaveNoSeam) {
  const Surface surface =
      std::make_shared<MadeUpSource>(test::rough_terrain(300, 300, 3, 400), kNorthWest, .0005);
  const int level = deepest_image_level(surface) + 3;  // of tiles of an eighth of the pixels
  const web_mercator::Tile parent = tile_at(level - 1, {7.08, 46.23});
  const auto whole = gradient_image(surface, parent, 128);
  ASSERT_TRUE(whole);
  for (int q = 0; q < 4; ++q) {
    const auto child =
        *web_mercator::tile(level, parent.x * 2 + unsigned(q % 2), parent.y * 2 + unsigned(q / 2));
    const auto part = gradient_image(surface, child, 64);
    ASSERT_TRUE(part);
    ASSERT_EQ(whole->samples, part->samples);
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        const auto in_whole = std::size_t((y + q / 2 * 64) * 128 + x + q % 2 * 64);
        const auto in_part = std::size_t(y * 64 + x);
        ASSERT_FALSE(part->empty(in_part));
        ASSERT_NEAR(whole->east[in_whole], part->east[in_part], 1e-4) << x << " " << y;
        ASSERT_NEAR(whole->north[in_whole], part->north[in_part], 1e-4) << x << " " << y;
      }
  }
}

/// Of 2 x 2 pixels of the children: gradients are averaged, not looked up in a coarser DEM.
TEST(Shades, AParentsPixelIsTheMeanOfItsChildren) {
  const Surface surface =
      std::make_shared<MadeUpSource>(test::rough_terrain(300, 300, 3, 400), kNorthWest, .0005);
  const int level = deepest_image_level(surface) + 3;
  const web_mercator::Tile parent = tile_at(level - 1, {7.08, 46.23});
  const auto whole = gradient_image(surface, parent, 64);
  const auto child =
      gradient_image(surface, *web_mercator::tile(level, parent.x * 2, parent.y * 2), 64);
  ASSERT_TRUE(whole && child);
  ASSERT_EQ(whole->samples, 2 * child->samples);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      double sum = 0;
      for (int k = 0; k < 4; ++k)
        sum += child->east[std::size_t((2 * y + k / 2) * 64 + 2 * x + k % 2)];
      EXPECT_NEAR(whole->east[std::size_t(y * 64 + x)], sum / 4, 1e-4);
    }
}

TEST(Shades, LeaveVoidsOut) {
  HeightGrid grid = test::terrain_with_voids(120, 120, 5);
  for (int r = 0; r < grid.rows(); ++r)
    for (float& h : grid.row(r)) h = std::isnan(h) ? h : 3000;  // flat: a pit would be steep
  const Surface surface = std::make_shared<MadeUpSource>(grid, kNorthWest, .001);
  const auto tile = tile_at(deepest_image_level(surface), {7.06, 46.25});
  const auto image = gradient_image(surface, tile, kImagePixels);
  const auto heights = height_image(surface, tile);
  ASSERT_TRUE(image && heights);
  int there = 0;
  for (std::size_t k = 0; k < image->east.size(); ++k) {
    if (image->empty(k)) continue;
    ++there;
    ASSERT_EQ(image->east[k], 0);
    ASSERT_EQ(image->north[k], 0);
  }
  const double with_heights = (1 - heights->filled_share) * kImagePixels * kImagePixels;
  EXPECT_LE(there, with_heights + .5);
  EXPECT_GT(there, with_heights * .95);
}

TEST(Shades, StopWhenNobodyWaits) {
  std::stop_source stopped;
  stopped.request_stop();
  const auto image = gradient_image(plane(1, 1), {0, 0, 0}, 64, stopped.get_token());
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, Errc::cancelled);
}

}  // namespace
}  // namespace tind
