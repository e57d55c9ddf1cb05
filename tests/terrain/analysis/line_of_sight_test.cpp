// The truth of these tests is a ray that is looked at every few metres, by geometry of its own.

#include "terrain/analysis/line_of_sight.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/raster/interpolate.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

/// Smooth enough to see something, rough enough not to see everything.
HeightGrid hills(int cols, int rows, unsigned seed) {
  return test::rough_terrain(cols, rows, seed, 300);
}

struct Line {
  SightEnd from, to;
};

class Lines {
 public:
  explicit Lines(unsigned seed) : random_(seed) {}
  Line next() {
    return {{{lon_(random_), lat_(random_)}, height_(random_)},
            {{lon_(random_), lat_(random_)}, height_(random_)}};
  }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> lon_{10.001, 10.039}, lat_{49.961, 49.999},
      height_{0.5, 60};
};

constexpr double kSpacing = 0.001;
MadeUpSource dem_of(HeightGrid grid) { return MadeUpSource(std::move(grid), {10, 50}, kSpacing); }

/// The least clearance among samples, by spherical trigonometry's place: straight in space; and
/// the share of the way at which the first one is below zero.
struct Sampled {
  double least = 1e9, first_hidden = -1;
};
Sampled sampled_clearance(const MadeUpSource& dem, const Line& line, double refraction,
                          int samples) {
  const auto ground = [&](Geographic p) {
    const Vec2 at = dem.info().post_to_crs.invert(p.lon, p.lat);
    const int c = int(std::floor(at.x)), r = int(std::floor(at.y));
    const HeightGrid& g = dem.grid();
    return height_between(g.at(c, r), g.at(c + 1, r), g.at(c, r + 1), g.at(c + 1, r + 1), at.x - c,
                          at.y - r);
  };
  const Vec3 a =
      wgs84::to_ecef(line.from.place, ground(line.from.place) + line.from.above_ground_m);
  const Vec3 b = wgs84::to_ecef(line.to.place, ground(line.to.place) + line.to.above_ground_m);
  const double length_m = length(b - a);
  Sampled found;
  for (int i = 0; i <= samples; ++i) {
    const double u = double(i) / samples;
    const auto at = wgs84::from_ecef(a + (b - a) * u);
    const double lift = refraction * u * (1 - u) * length_m * length_m / (2 * 6.378e6);
    const double clearance = at.height_m + lift - ground(at.p);
    found.least = std::min(found.least, clearance);
    if (clearance < 0 && found.first_hidden < 0) found.first_hidden = u;
  }
  return found;
}

TEST(LineOfSight, IsWhatSamplesSayAndNoSampleFindsLess) {
  const MadeUpSource dem = dem_of(hills(41, 41, 5));
  Lines lines(1);
  int visible = 0, hidden = 0;
  for (int round = 0; round < 400; ++round) {
    const Line line = lines.next();
    const auto found = line_of_sight(dem, line.from, line.to, {});
    ASSERT_TRUE(found) << found.error().what;
    const auto [sampled, hidden_at] = sampled_clearance(dem, line, 0.13, 3000);
    ASSERT_TRUE(found->nearest);
    ASSERT_LE(found->nearest->clearance_m, sampled + 0.01) << round;
    ASSERT_GE(found->nearest->clearance_m, sampled - 0.5) << round;
    ASSERT_NE(found->visibility, Visibility::depends);
    visible += found->visibility == Visibility::visible;
    hidden += found->visibility == Visibility::hidden;
    ASSERT_EQ(found->visibility == Visibility::hidden, found->first_hidden_share.has_value());
    if (found->first_hidden_share && sampled < -0.1) {
      ASSERT_NEAR(*found->first_hidden_share, hidden_at, 2.0 / 3000) << round;
    }
    const auto back = line_of_sight(dem, line.to, line.from, {});
    ASSERT_TRUE(back);
    ASSERT_NEAR(back->nearest->clearance_m, found->nearest->clearance_m, 1e-2);
  }
  EXPECT_GT(visible, 40);
  EXPECT_GT(hidden, 40);
}

TEST(LineOfSight, CertainAnswersAreThoseOfTheTruth) {
  std::mt19937 random(11);
  int certain[3] = {};
  for (const double e : {0.05, 0.5, 4.0, 20.0}) {
    for (int world = 0; world < 5; ++world) {
      const HeightGrid truth = hills(41, 41, 20 + unsigned(world));
      HeightGrid seen = truth;
      // Errors that are as large as they may be, and all between.
      std::uniform_real_distribution<double> error(-e, e);
      std::bernoulli_distribution full(0.5), up(0.5);
      for (float& z : seen.values())
        z = float(z + 0.999 * (full(random) ? (up(random) ? e : -e) : error(random)));
      const MadeUpSource real = dem_of(truth), asked = dem_of(seen);
      Lines lines(100 + unsigned(world));
      for (int round = 0; round < 500; ++round) {
        const Line line = lines.next();
        const auto told = line_of_sight(asked, line.from, line.to, {.uncertainty_m = e});
        const auto true_one = line_of_sight(real, line.from, line.to, {.tolerance_posts = 1e-6});
        ASSERT_TRUE(told && true_one);
        ++certain[int(told->visibility)];
        if (told->visibility == Visibility::depends) continue;
        ASSERT_EQ(told->visibility, true_one->visibility) << e << " " << world << " " << round;
        ASSERT_GE(true_one->nearest->clearance_m, *told->surely_m - 1e-3);
        ASSERT_LE(true_one->nearest->clearance_m, *told->perhaps_m + 1e-3);
      }
    }
  }
  EXPECT_GT(certain[int(Visibility::visible)], 1000);
  EXPECT_GT(certain[int(Visibility::hidden)], 1000);
  EXPECT_GT(certain[int(Visibility::depends)], 500);
}

TEST(LineOfSight, TheEarthCurvesAndLightBends) {
  // Over a sea of 40 km two masts see each other from about 5 * 20 km^2 / (2 R): 31.4 m each.
  const MadeUpSource sea(HeightGrid(600, 41, 0), {10, 50}, 0.001);
  const auto sees = [&](double mast_m, double refraction) {
    const auto line = line_of_sight(sea, {{10.01, 49.98}, mast_m}, {{10.567, 49.98}, mast_m},
                                    {.refraction = refraction});
    EXPECT_TRUE(line);
    EXPECT_NEAR(line->length_m, 39'940, 30);
    return line->visibility == Visibility::visible;
  };
  const double half = 39'940 / 2.0, bulge = half * half / (2 * 6.387e6);
  EXPECT_FALSE(sees(bulge * 0.995, 0));
  EXPECT_TRUE(sees(bulge * 1.005, 0));
  EXPECT_FALSE(sees(bulge * 0.86, 0.13));
  EXPECT_TRUE(sees(bulge * 0.88, 0.13));
}

TEST(LineOfSight, OverVoidsNothingIsVisibleForCertain) {
  HeightGrid grid(41, 41, 100);
  for (int r = 0; r < 41; ++r) grid.at(20, r) = HeightGrid::kVoid;
  const MadeUpSource dem = dem_of(grid);
  const SightEnd west{{10.005, 49.98}, 10}, east{{10.035, 49.98}, 10};
  const auto over = line_of_sight(dem, west, east, {});
  ASSERT_TRUE(over);
  EXPECT_EQ(over->visibility, Visibility::depends);
  EXPECT_TRUE(over->unknown);
  const auto inside = line_of_sight(dem, west, {{10.015, 49.985}, 10}, {});
  ASSERT_TRUE(inside);
  EXPECT_EQ(inside->visibility, Visibility::visible);
  const auto in_void = line_of_sight(dem, {{10.02, 49.98}, 1}, east, {});
  ASSERT_FALSE(in_void);
  EXPECT_EQ(in_void.error().code, Errc::invalid_argument);
  const auto outside = line_of_sight(dem, west, {{11, 49.98}, 1}, {});
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, Errc::invalid_argument);
}

TEST(LineOfSight, AReadErrorIsAnError) {
  const MadeUpSource dem = dem_of(HeightGrid(41, 41, 100));
  dem.reads_left = 2;  // of the two ends
  const auto line = line_of_sight(dem, {{10.005, 49.98}, 1}, {{10.03, 49.98}, 1}, {});
  ASSERT_FALSE(line);
  EXPECT_EQ(line.error().code, Errc::io);
}

TEST(LineOfSight, OfASurfaceThatMayBeOffAnywhereNothingIsCloserAtTheEnds) {
  const MadeUpSource dem = dem_of(HeightGrid(40, 40, 0));
  // Level ground, both ends a metre above it, 360 m apart: the ray sinks by 2 mm.
  const SightEnd west{{10.005, 49.98}, 1}, east{{10.010, 49.98}, 1};
  for (const double f : {0.4, 0.6}) {
    const auto line = line_of_sight(dem, west, east, {.anywhere_m = f});
    ASSERT_TRUE(line);
    EXPECT_EQ(line->visibility, f < 0.5 ? Visibility::visible : Visibility::depends);
    EXPECT_NEAR(*line->surely_m, 1 - 2 * f, 0.005);
    EXPECT_NEAR(*line->perhaps_m, 1 + 2 * f, 0.005);
    // With as much of the posts, both are what is left of it.
    const auto both = line_of_sight(dem, west, east, {.uncertainty_m = 0.1, .anywhere_m = f});
    ASSERT_TRUE(both);
    EXPECT_GE(*both->surely_m, 1 - 2 * (f + 0.1) - 0.005);
    EXPECT_LE(*both->surely_m, 1 - 2 * f);
  }
}

}  // namespace
}  // namespace tind
