#include "terrain/geo/geoid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

std::shared_ptr<const Geoid> egm96() {
  auto geoid = test::environment()->egm96();
  EXPECT_TRUE(geoid.has_value()) << (geoid ? "" : geoid.error().what);
  return geoid ? *geoid : nullptr;
}

/// NGA's test points of its EGM96 program (INPUT.DAT, OUTF477.DAT), the full model to degree 360.
TEST(Geoid, PublishedPointsOfTheModel) {
  const auto geoid = egm96();
  ASSERT_TRUE(geoid);
  const struct {
    double lat, lon, undulation;
  } known[] = {
      {38.6281550, 269.7791550, -31.628}, {-14.6212170, 305.0211140, -2.969},
      {46.8743190, 102.4487290, -43.575}, {-23.6174460, 133.8747120, 15.871},
      {38.6254730, 359.9995000, 50.066},  {-0.4667440, 0.0023000, 17.329},
  };
  double worst = 0;
  for (const auto& k : known) {
    const double n = geoid->undulation({k.lon, k.lat});
    EXPECT_NEAR(n, k.undulation, 0.15) << k.lat << " " << k.lon;
    EXPECT_EQ(n, geoid->undulation({k.lon > 180 ? k.lon - 360 : k.lon + 360, k.lat}));
    worst = std::max(worst, std::abs(n - k.undulation));
  }
  RecordProperty("worst_m", std::to_string(worst));
}

TEST(Geoid, AgreesWithTheGridItIsMadeOf) {
  TIND_NEEDS_SHARED_DATA(file, "geoid/egm96_15.tif");
  const auto geoid = egm96();
  const auto grid = DemSource::open({&file, 1});
  ASSERT_TRUE(geoid && grid) << (grid ? "" : grid.error().what);
  const auto n = (*grid)->read(0, 0, 1440, 721);
  ASSERT_TRUE(n);
  std::vector<Vec2> posts(1440);
  std::vector<Geographic> places(1440);
  double worst = 0;
  for (int r = 0; r < 721; r += 4) {
    for (int c = 0; c < 1440; ++c) posts[c] = {double(c), double(r)};
    (*grid)->to_geographic(posts, places);
    for (int c = 0; c < 1440; ++c)
      worst = std::max(worst, std::abs(geoid->undulation(places[c]) - double(n->at(c, r))));
  }
  EXPECT_LT(worst, 0.0016);  // half a step of 3 mm
}

TEST(Geoid, SameFromManyThreads) {
  const auto geoid = egm96();
  ASSERT_TRUE(geoid);
  std::vector<double> sums(4, 0);
  std::vector<std::jthread> threads;
  for (double& sum : sums)
    threads.emplace_back([&] {
      for (int i = 0; i < 20000; ++i)
        sum += geoid->undulation({(i * 7919) % 3600 / 10.0, (i * 104729) % 1800 / 10.0 - 90});
    });
  threads.clear();
  for (const double sum : sums) EXPECT_EQ(sum, sums[0]);
}

TEST(Geoid, DamagedGridIsAnError) {
  const test::TempDir folder;
  EXPECT_FALSE(Geoid::load(folder.path().string(), "egm96-15"));
  std::ofstream(folder.file("egm96-15.pgm"))
      << "P5\n# Offset -108\n# Scale 0.003\n1440 721\n65535\n";
  const auto damaged = Geoid::load(folder.path().string(), "egm96-15");
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().what, testing::HasSubstr("scripts/make_geoid"));
}

}  // namespace
}  // namespace tind
