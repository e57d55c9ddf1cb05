// Tiles of Mount Rainier: what is certain of them is so of the DEM.

#include "terrain/analysis/level_dem.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <random>

#include "terrain/analysis/line_of_sight.h"
#include "terrain/analysis/profile.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "tests/support/support.h"

namespace tind {
namespace {

/// A DEM held in memory: thousands of lines ask for the same posts.
class Held : public DemSource {
 public:
  explicit Held(const DemSource& source)
      : source_(source),
        posts_(*source.read(0, 0, int(source.info().cols), int(source.info().rows))) {}

  const DemInfo& info() const override { return source_.info(); }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return read_decimated(col, row, cols, rows, 1);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    HeightGrid out(cols, rows);
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < cols; ++c) {
        const std::int64_t x = col + std::int64_t(c) * step, y = row + std::int64_t(r) * step;
        if (x >= 0 && y >= 0 && x < posts_.cols() && y < posts_.rows())
          out.at(c, r) = posts_.at(int(x), int(y));
      }
    return out;
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    source_.to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    source_.to_geographic(in, out);
  }
  bool is_plain_geographic() const override { return source_.is_plain_geographic(); }

 private:
  const DemSource& source_;
  HeightGrid posts_;
};

class LevelDemTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto source = DemSource::open(
        std::array{test::testdata("rainier.tif")},
        {.to_datum = TargetDatum::ellipsoid_if_known, .environment = test::environment()});
    ASSERT_TRUE(source) << source.error().what;
    dem_ = *source;
    auto tiles = open_dem_tiles(Surface(dem_), {});
    ASSERT_TRUE(tiles) << tiles.error().what;
    tiles_ = std::move(*tiles);
  }
  std::shared_ptr<const LevelDem> seen(int level) const {
    return std::make_shared<const LevelDem>(dem_, level_tiles_of(*tiles_), level,
                                            VerticalDatum::ellipsoid);
  }
  std::shared_ptr<const DemSource> dem_;
  std::shared_ptr<const TileSet> tiles_;
};

TEST_F(LevelDemTest, IsWithinItsErrorAtEveryPostAndHasTheDemsVoids) {
  const auto level = seen(9);
  const int cols = int(dem_->info().cols), rows = int(dem_->info().rows);
  const auto posts = dem_->read(0, 0, cols, rows), mesh = level->read(0, 0, cols, rows);
  ASSERT_TRUE(posts && mesh);
  EXPECT_GT(level->max_error_m(), 1);
  double worst = 0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c) {
      ASSERT_EQ(posts->is_void(c, r), mesh->is_void(c, r)) << c << " " << r;
      if (!posts->is_void(c, r))
        worst = std::max(worst, double(std::abs(posts->at(c, r) - mesh->at(c, r))));
    }
  EXPECT_LE(worst, level->max_error_m());
  EXPECT_GT(worst, 0.2 * level->max_error_m());
}

TEST_F(LevelDemTest, AProfileIsABandThatHoldsTheDems) {
  const auto level = seen(9);
  const Geographic places[] = {{-121.9, 46.72}, {-121.65, 46.93}};
  const GeodesicPath path(places);
  const auto distances = even_distances(path.length_m(), 3000);
  const auto mesh = sampled_profile(*level, path, distances);
  const auto truth = sampled_profile(*dem_, path, distances);
  ASSERT_TRUE(mesh && truth);
  const double e = level->max_error_m();
  for (std::size_t i = 0; i < distances.size(); ++i) {
    ASSERT_EQ(mesh->points[i].height.coverage, truth->points[i].height.coverage);
    ASSERT_LE(std::abs(mesh->points[i].height.height_m - truth->points[i].height.height_m), e);
  }
}

TEST_F(LevelDemTest, CertainLinesOfSightAreThoseOfTheDem) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> lon(-121.97, -121.51), lat(46.61, 46.99), height(2, 400);
  // scripts/sight_lines asks for more.
  const char* const asked = std::getenv("TIND_SIGHT_LINES");
  const int lines = asked ? std::atoi(asked) : 600;
  const auto tiles = seen(10);
  const Held truth(*dem_), mesh(*tiles);
  const double e = tiles->max_error_m();
  int told[3] = {}, wrong = 0;
  for (int i = 0; i < lines; ++i) {
    const SightEnd from{{lon(random), lat(random)}, height(random)};
    SightEnd to{{lon(random), lat(random)}, height(random)};
    // Not all across the map: what is near is seen more often.
    const double near = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.2 : 0.05;
    to.place = {from.place.lon + near * (to.place.lon - from.place.lon),
                from.place.lat + near * (to.place.lat - from.place.lat)};
    const auto true_one = line_of_sight(truth, from, to, {.tolerance_posts = 1e-6});
    if (!true_one) continue;  // in a void
    const auto found = line_of_sight(mesh, from, to, {.uncertainty_m = e});
    ASSERT_TRUE(found) << found.error().what;
    ++told[int(found->visibility)];
    wrong += found->visibility != Visibility::depends &&
             true_one->visibility != Visibility::depends &&
             found->visibility != true_one->visibility;
  }
  EXPECT_EQ(wrong, 0);
  if (asked)
    std::printf(
        "%d lines over tiles of level 10 (within %.2f m): %d hidden, %d visible, %d depend; "
        "%d of the certain ones are wrong\n",
        lines, e, told[0], told[1], told[2], wrong);
  EXPECT_GT(told[int(Visibility::visible)], lines / 50);
  EXPECT_GT(told[int(Visibility::hidden)], lines / 10);
}

}  // namespace
}  // namespace tind
