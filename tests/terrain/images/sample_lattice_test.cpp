// Where images ask for H: everywhere that there is one, and hardly anywhere else.

#include "terrain/images/sample_lattice.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "terrain/images/height_image.h"
#include "tests/support/made_up_source.h"
#include "tests/support/projected_dem.h"

namespace tind {
namespace {

constexpr int kPixels = 64;

/// Counts the places that are looked for in another source.
class Counted : public DemSource {
 public:
  explicit Counted(std::shared_ptr<const DemSource> source) : source_(std::move(source)) {}

  const DemInfo& info() const override { return source_->info(); }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return source_->read(col, row, cols, rows);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    return source_->read_decimated(col, row, cols, rows, step);
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    places += std::int64_t(in.size());
    source_->to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    source_->to_geographic(in, out);
  }
  bool is_plain_geographic() const override { return source_->is_plain_geographic(); }

  mutable std::atomic<std::int64_t> places = 0;

 private:
  std::shared_ptr<const DemSource> source_;
};

/// The tile of a level in which the source's first post lies.
web_mercator::Tile tile_of(const DemSource& source, int level) {
  const Vec2 post;
  Geographic p;
  source.to_geographic({&post, 1}, {&p, 1});
  const double side = std::ldexp(1., level);
  return *web_mercator::tile(level, std::int64_t(web_mercator::u_of(p.lon) * side),
                             std::int64_t(web_mercator::v_of(p.lat) * side));
}

class SampleLattices : public ::testing::TestWithParam<test::ProjectedDem> {
 protected:
  test::TempDir folder_;
  std::shared_ptr<const DemSource> source_ = test::open_projected(GetParam(), folder_);
};

TEST_P(SampleLattices, MissNoHeight) {
  ASSERT_TRUE(source_);
  const Surface surface(source_);
  std::size_t found = 0;
  for (int level = 0; level <= deepest_image_level(surface); ++level) {
    SampleLattice lattice(surface, tile_of(*source_, level), kPixels);
    std::vector<double> heights(std::size_t(lattice.side()) + 2), all(heights.size());
    std::vector<Geographic> places(heights.size());
    const auto done = lattice.each_pixel_row(1, {}, [&](int row) {
      lattice.heights(row * lattice.samples(), -1, heights);
      for (std::size_t i = 0; i < places.size(); ++i)
        places[i] = {lattice.lon_of(int(i) - 1), lattice.lat_of(row * lattice.samples())};
      lattice.field().at(places, all);
      for (std::size_t i = 0; i < all.size(); ++i) {
        ASSERT_EQ(std::isnan(heights[i]), std::isnan(all[i])) << level << " " << row << " " << i;
        if (std::isnan(all[i])) continue;
        ASSERT_EQ(heights[i], all[i]);
        ++found;
      }
      lattice.field().filled(places, all);
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (all[i] == 0) continue;
        ASSERT_TRUE(lattice.may_fill(places[i])) << places[i].lon;
      }
    });
    ASSERT_TRUE(done) << done.error().what;
  }
  EXPECT_GT(found, 100u);
}

TEST_P(SampleLattices, LookForNoPlaceFarAway) {
  ASSERT_TRUE(source_);
  const auto counted = std::make_shared<Counted>(source_);
  for (const int level : {0, 1}) {
    const auto image = height_image(Surface(counted), tile_of(*source_, level), kPixels);
    ASSERT_TRUE(image) << image.error().what;
    EXPECT_EQ(image->samples, 8);
  }
  EXPECT_LT(counted->places, 2 * kPixels * kPixels * 64 / 20);
}

INSTANTIATE_TEST_SUITE_P(
    Projections, SampleLattices,
    ::testing::Values(test::ProjectedDem{"utm32", "EPSG:32632", 300000, 5100000, 2000, 90, 70},
                      test::ProjectedDem{"fiji", "EPSG:32760", 760000, 8050000, 2000, 90, 60},
                      test::ProjectedDem{"lv95", "EPSG:2056", 2600000, 1200000, 500, 60, 60},
                      test::ProjectedDem{"polar", "EPSG:3413", -300000, -600000, 4000, 80, 60}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace tind
