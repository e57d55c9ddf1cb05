// Buckets as FlightGear reads them: every post within the stated error, no crack, above the sea.

#include "terrain/flightgear/bucket.h"

#include <gtest/gtest.h>

#include <fstream>

#include "terrain/base/parallel.h"
#include "terrain/base/sha1.h"
#include "terrain/flightgear/cover_materials.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/surface/open_surface.h"
#include "tests/support/made_up_source.h"
#include "tests/support/projected_dem.h"
#include "tests/support/shapes_file.h"
#include "tests/support/support.h"
#include "tests/terrain/flightgear/decoded_bucket.h"
#include "tests/terrain/flightgear/made_up_cover.h"

namespace tind::flightgear {
namespace {

using test::DecodedBucket;
using test::MadeUpSource;

struct Made {
  BucketId id;
  Bucket bucket;
  DecodedBucket decoded;
};

std::vector<Made> make_all(const BucketPlan& plan, const std::vector<BucketId>& ids,
                           const LandCover* cover = nullptr) {
  std::vector<std::optional<Bucket>> buckets(ids.size());
  parallel_for(ids.size(), 2, [&](std::size_t i) {
    auto made = make_bucket(plan, ids[i], {}, cover);
    ASSERT_TRUE(made) << made.error().what;
    buckets[i] = std::move(*made);
  });
  std::vector<Made> all;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (buckets[i]) all.push_back({ids[i], *buckets[i], DecodedBucket(buckets[i]->btg_gz)});
  return all;
}

BucketPlan plan_of(const Surface& surface, double max_error_m = 0) {
  auto plan = BucketPlan::make(surface, {max_error_m, Effort::fast}, *test::environment());
  EXPECT_TRUE(plan) << plan.error().what;
  return std::move(*plan);
}

/// Every side is shared by two triangles, but for those on the outline of the block.
void expect_no_cracks(const std::vector<Made>& all, const GeoRect& block) {
  std::vector<const DecodedBucket*> buckets;
  for (const Made& m : all) buckets.push_back(&m.decoded);
  const auto near = [](double a, double b) { return std::abs(a - b) < 1e-6; };
  std::size_t inside = 0, outline = 0;
  for (const auto& [side, count] : test::open_sides(buckets)) {
    const auto place = [](const std::array<double, 3>& p) {
      return wgs84::from_ecef({p[0], p[1], p[2]}).p;
    };
    const Geographic p = place(side.first), q = place(side.second);
    const auto both = [&](double Geographic::*x, double line) {
      return near(p.*x, line) && near(q.*x, line);
    };
    const bool on_outline =
        both(&Geographic::lon, block.west) || both(&Geographic::lon, block.east) ||
        both(&Geographic::lat, block.south) || both(&Geographic::lat, block.north);
    ++(on_outline ? outline : inside);
  }
  EXPECT_EQ(inside, 0u) << "sides that only one triangle has";
  EXPECT_GE(outline, 4u);
}

/// Of all posts over some bucket: each bucket's ground is within its error.
std::size_t expect_errors(const std::vector<Made>& all, const DemSource& dem,
                          const GeoRect& block) {
  const auto heights = dem.read(0, 0, int(dem.info().cols), int(dem.info().rows));
  std::size_t measured = 0, holes = 0;
  for (int row = 0; row < heights->rows(); ++row)
    for (int col = 0; col < heights->cols(); ++col) {
      const float z = heights->at(col, row);
      const Vec2 post{double(col), double(row)};
      Geographic p;
      dem.to_geographic({&post, 1}, {&p, 1});
      if (std::isnan(z) || !block.contains(p)) continue;
      bool met = false;
      for (const Made& m : all) {
        const GeoRect r = rect(m.id);
        const double margin = 0.01;
        if (p.lon < r.west - margin || p.lon > r.east + margin || p.lat < r.south - margin ||
            p.lat > r.north + margin)
          continue;
        const auto ground = m.decoded.height_at(p);
        if (!ground) continue;
        met = true, ++measured;
        EXPECT_LE(std::abs(*ground - z), m.bucket.max_error_m)
            << p.lon << " " << p.lat << " in " << index_of(m.id);
      }
      // Near the outline of the block the sides of triangles may bow inwards.
      const double inner = 1e-3;
      holes += !met && p.lon > block.west + inner && p.lon < block.east - inner &&
               p.lat > block.south + inner && p.lat < block.north - inner;
    }
  EXPECT_EQ(holes, 0u);
  return measured;
}

/// Two rows of buckets on both sides of a parallel where widths change, as wide as the wider.
struct Block {
  double lat;
  double spacing_deg;
};

class Parallel : public ::testing::TestWithParam<Block> {};

TEST_P(Parallel, NoCrackAndEveryPostWithinTheError) {
  const auto [lat, spacing] = GetParam();
  const int row = int((lat + 90) * 8);
  const int width = std::max(width_of_row(row - 1), width_of_row(row));
  const double west = 9 - std::fmod(9, width / 8.0);
  const GeoRect whole{west, lat - 0.125, west + width / 8.0, lat + 0.125};
  const MadeUpSource dem(
      test::rough_terrain(int((width / 8.0 + 0.2) / spacing), int(0.45 / spacing), 7, 900),
      {whole.west - 0.1, lat + 0.225}, spacing);
  const BucketPlan plan = plan_of(dem, std::max(4.0, spacing * 111320 / 32));
  std::vector<BucketId> ids;
  for (const int r : {row - 1, row})
    for (int x = 0; x < width; x += width_of_row(r))
      ids.push_back({r, int((whole.west + 180) * 8) + x});
  const auto all = make_all(plan, ids);
  ASSERT_EQ(all.size(), ids.size());
  expect_no_cracks(all, whole);
  EXPECT_GT(expect_errors(all, dem, whole), 100u);
  for (const Made& m : all) EXPECT_LE(m.bucket.max_error_m, plan.budget_m(rect(m.id)));
}

INSTANTIATE_TEST_SUITE_P(Buckets, Parallel,
                         ::testing::Values(Block{22, 1 / 700.}, Block{-22, 1 / 700.},
                                           Block{45, 1 / 700.}, Block{62, 1 / 500.},
                                           Block{-76, 1 / 400.}, Block{83, 1 / 300.},
                                           Block{86, 1 / 200.}, Block{89, 1 / 100.},
                                           Block{-89, 1 / 100.}));

TEST(BucketPlan, ListsTheBucketsThatThereAre) {
  for (const double lat : {22.3, 62.1, -85.9, 89.2}) {
    const MadeUpSource dem(test::grid_from("1 2 3 / 4 5 6 / 7 8 9"), {-0.3, lat}, 0.25);
    const BucketPlan plan = plan_of(dem);
    std::vector<BucketId> there;
    for (int row = 0; row < kRows; ++row)
      for (int x = 0; x < 2880; x += width_of_row(row))
        if (has_bucket(plan.surface(), {row, x})) there.push_back({row, x});
    auto listed = plan.buckets();
    std::ranges::sort(listed);
    EXPECT_EQ(listed, there) << lat;
  }
}

TEST(Bucket, OfManyPostsIsMadeOfPatchesWithoutACrack) {
  // 2.8 m: eight patches a side, of which a bucket of the DEM's size has those at its corner.
  const double spacing = 1 / 40000.;
  const MadeUpSource dem(test::rough_terrain(500, 500, 3, 60), {9.995, 45.13}, spacing);
  const BucketPlan plan = plan_of(dem, 1);
  EXPECT_GT(plan.parts_of_eighth(), 4);
  const std::vector<BucketId> ids = plan.buckets();
  ASSERT_EQ(ids.size(), 4u);  // it lies around a corner
  const auto all = make_all(plan, ids);
  expect_no_cracks(all, {9.75, 45, 10.25, 45.25});
  EXPECT_GT(expect_errors(all, dem, {9.9951, 45.1176, 10.0074, 45.1299}), 230000u);
}

TEST(Bucket, KeepsAFineBoundOnSteepGround) {
  // 93 m between posts that differ by hundreds: a unit of a whole bucket's grid is 0.42 m, which is
  // as much height there. So the finer the bound, the smaller the parts.
  const MadeUpSource dem(test::rough_terrain(160, 160, 7, 900), {10, 45.13}, 1 / 1200.);
  for (const double error : {0.05, 0.3, 8.0}) {
    const BucketPlan plan = plan_of(dem, error);
    const auto all = make_all(plan, {bucket_at({10.05, 45.1})});
    ASSERT_EQ(all.size(), 1u);
    EXPECT_GT(expect_errors(all, dem, {10.001, 45.001, 10.124, 45.124}), 20000u);
    EXPECT_LE(all[0].bucket.max_error_m, error);
  }
}

TEST(Bucket, SideBySideOnTheAntimeridian) {
  const std::string file = test::shared_data("dem/etopo5_int16.tif");
  if (file.empty()) GTEST_SKIP() << "needs dem/etopo5_int16.tif of the shared data";
  const auto dem = DemSource::open(std::vector{file});
  ASSERT_TRUE(dem) << dem.error().what;
  const BucketPlan plan = plan_of(*dem, 100);
  std::vector<BucketId> ids;
  const BucketId east = bucket_at({179.99, -17.3});  // Fiji
  for (const int row : {east.row, east.row + 1}) ids.push_back({row, east.eighths});
  for (const int row : {east.row, east.row + 1}) ids.push_back({row, 0});
  const auto all = make_all(plan, ids);
  ASSERT_EQ(all.size(), 4u);
  std::size_t on_it = 0;
  std::vector<const DecodedBucket*> buckets;
  for (const Made& m : all) buckets.push_back(&m.decoded);
  for (const auto& [side, count] : test::open_sides(buckets))
    on_it += side.first[1] == 0 && side.second[1] == 0 && side.first[0] < 0;
  EXPECT_EQ(on_it, 0u);
}

TEST(Bucket, AtThePolesThereAreNoHoles) {
  const std::string file = test::shared_data("dem/etopo5_int16.tif");
  if (file.empty()) GTEST_SKIP() << "needs dem/etopo5_int16.tif of the shared data";
  const auto dem = DemSource::open(std::vector{file});
  ASSERT_TRUE(dem) << dem.error().what;
  const BucketPlan plan = plan_of(*dem, 50);
  for (const double lat : {-89.95, 89.95}) {
    std::vector<BucketId> ids;
    for (int x = 0; x < 2880; x += 96) ids.push_back({bucket_at({0, lat}).row, x});
    const auto all = make_all(plan, ids);
    ASSERT_EQ(all.size(), 30u);
    std::vector<const DecodedBucket*> buckets;
    for (const Made& m : all) buckets.push_back(&m.decoded);
    for (const auto& [side, count] : test::open_sides(buckets)) {
      const double z = (std::abs(side.first[2]) + std::abs(side.second[2])) / 2;
      EXPECT_LT(std::hypot(side.first[0], side.first[1]), 15000);
      EXPECT_GT(std::hypot(side.first[0], side.first[1]), 13000) << z;  // the parallel at its foot
    }
  }
}

TEST(Bucket, HasHeightsAboveTheSeaWhateverTheSurfaceHas) {
  DemOptions options;
  options.from_datum = VerticalDatum::egm96;
  options.environment = test::environment();
  const auto sea = DemSource::open(std::vector{test::testdata("rainier.tif")}, options);
  options.to_datum = TargetDatum::ellipsoid;
  const auto ellipsoid = DemSource::open(std::vector{test::testdata("rainier.tif")}, options);
  ASSERT_TRUE(sea && ellipsoid);
  const GeoRect& b = (*sea)->info().bounds;
  const BucketId id = bucket_at({(b.west + b.east) / 2, (b.south + b.north) / 2});
  for (const auto& dem : {*sea, *ellipsoid}) {
    auto all = make_all(plan_of(dem), {id});
    ASSERT_EQ(all.size(), 1u);
    all[0].bucket.max_error_m += 0.001;  // float32 heights of the other datum
    EXPECT_GT(expect_errors(all, **sea, rect(id)), 1000u);
  }
}

TEST(Bucket, IsTheSeaBeyondTheHeights) {
  // A corner of a bucket where the geoid lies 48 m above the ellipsoid, in heights above the
  // latter.
  const test::TempDir folder;
  std::ofstream(folder.file("corner.asc"))
      << "ncols 3\nnrows 3\nxllcenter 10\nyllcenter 45\ncellsize 0.0002\n9 9 9\n9 9 9\n9 9 9\n";
  DemOptions options;
  options.crs = "EPSG:4326";
  options.from_datum = VerticalDatum::egm96, options.to_datum = TargetDatum::ellipsoid;
  options.environment = test::environment();
  const auto dem = DemSource::open(std::vector{folder.file("corner.asc")}, options);
  ASSERT_TRUE(dem) << dem.error().what;
  const auto all = make_all(plan_of(*dem, 0.5), {bucket_at({10.0001, 45.0001})});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NEAR(*all[0].decoded.height_at({10.0002, 45.0002}), 9, 0.6);
  for (const Geographic& p : {Geographic{10.1, 45.1}, {10.05, 45.005}, {10.001, 45.12}})
    EXPECT_NEAR(*all[0].decoded.height_at(p), 0, 0.6) << p.lon;
  EXPECT_GT(all[0].bucket.void_share, 0.99);
  EXPECT_NEAR(read_stg(all[0].bucket.stg)->void_share, all[0].bucket.void_share, 1e-3);
}

TEST(Bucket, SaysHowMuchOfItHasNoHeight) {
  const MadeUpSource half(test::rough_terrain(63, 130, 1), {10, 10.127}, 0.001);  // to 10.062
  const auto all = make_all(plan_of(half, 5), {bucket_at({10.05, 10.05})});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NEAR(all[0].bucket.void_share, 0.5, 0.02);
  const MadeUpSource whole(test::rough_terrain(130, 130, 1), {9.999, 10.127}, 0.001);
  EXPECT_EQ(make_all(plan_of(whole, 5), {bucket_at({10.05, 10.05})})[0].bucket.void_share, 0);
}

TEST(Bucket, OfAProjectedDem) {
  const test::TempDir folder;
  const auto dem = test::open_projected({"utm32", "EPSG:32632", 459000, 5080000, 60, 400, 400},
                                        folder);  // 24 km around 9 E, 45.7 N
  ASSERT_TRUE(dem);
  const BucketPlan plan = plan_of(dem, 5);
  const auto all = make_all(plan, plan.buckets());
  EXPECT_GE(all.size(), 6u);
  GeoRect block = rect(all[0].id);
  for (const Made& m : all) {
    const GeoRect r = rect(m.id);
    block = {std::min(block.west, r.west), std::min(block.south, r.south),
             std::max(block.east, r.east), std::max(block.north, r.north)};
  }
  expect_no_cracks(all, block);
  EXPECT_GT(expect_errors(all, *dem, {8.48, 45.66, 8.76, 45.87}), 140000u);
}

TEST(Bucket, WithoutAPostIsNone) {
  const MadeUpSource dem(test::grid_from(". . . / . . . / . . ."), {10, 45}, 0.2);
  const BucketPlan plan = plan_of(dem, 10);
  for (const BucketId id : plan.buckets()) {
    const auto made = make_bucket(plan, id);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_FALSE(*made);
  }
}

TEST(Bucket, FlatOrOfOnePost) {
  const MadeUpSource flat(test::grid_from("7 7 7 / 7 7 7 / 7 7 7"), {10, 45.2}, 0.1);
  const BucketPlan plan = plan_of(flat, 1);
  const auto all = make_all(plan, {bucket_at({10.1, 45.1})});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_LE(all[0].bucket.max_error_m, 1);
  EXPECT_GE(all[0].bucket.triangles, 2u);
  EXPECT_NEAR(*all[0].decoded.height_at({10.1, 45.1}), 7, 1);
}

TEST(Bucket, SaysItsErrorAndItsFile) {
  const MadeUpSource dem(test::rough_terrain(90, 90, 1), {10, 45.2}, 0.002);
  const BucketId id = bucket_at({10.1, 45.1});
  const auto made = make_bucket(plan_of(dem), id);
  ASSERT_TRUE(made && *made);
  EXPECT_NE((*made)->stg.find("\nOBJECT_BASE " + std::to_string(index_of(id)) + ".btg\n"),
            std::string::npos)
      << (*made)->stg;
  const auto said = read_stg((*made)->stg);
  ASSERT_TRUE(said);
  EXPECT_EQ(said->sha1, sha1((*made)->btg_gz));
  EXPECT_EQ(said->posts, (*made)->posts);
  EXPECT_NEAR(said->max_error_m, (*made)->max_error_m, 1e-9);
  for (std::size_t n = 0; n < (*made)->stg.size(); ++n)
    EXPECT_FALSE(read_stg((*made)->stg.substr(0, n))) << n;
  EXPECT_FALSE(read_stg("OBJECT_BASE 5.btg\n"));
}

TEST(Bucket, WaterIsALake) {
  test::ShapesFile water("fg-water");
  water.polygon({{{10.02, 45.14}, {10.2, 45.14}, {10.2, 45.22}, {10.02, 45.22}}});
  const auto dem = std::make_shared<MadeUpSource>(test::rough_terrain(300, 300, 1),
                                                  Geographic{10, 45.26}, 0.001);
  ShapeFiles files;
  files.water = {water.write()};
  const auto surface = shaped_surface(Surface(dem), files);
  ASSERT_TRUE(surface) << surface.error().what;
  const auto all = make_all(plan_of(*surface), {bucket_at({10.1, 45.15})});
  ASSERT_EQ(all.size(), 1u);
  const auto& btg = all[0].decoded.btg;
  ASSERT_EQ(btg.parts.size(), 2u);
  EXPECT_EQ(btg.parts[0].material, "Default");
  EXPECT_EQ(btg.parts[1].material, "Lake");
  for (const auto& t : btg.parts[1].triangles)
    for (const auto& c : t) {
      const Vec3& p = all[0].decoded.vertices[c.vertex];
      EXPECT_GT(std::atan2(p.y, p.x) * 180 / M_PI, 10.01);
    }
}

/// The material of the triangle over a place, by the centres of triangles next to it.
std::string material_at(const DecodedBucket& bucket, Geographic p) {
  std::string material;
  double nearest = HUGE_VAL;
  for (const auto& part : bucket.btg.parts)
    for (const auto& t : part.triangles) {
      const Vec3 middle = (bucket.vertices[t[0].vertex] + bucket.vertices[t[1].vertex] +
                           bucket.vertices[t[2].vertex]) *
                          (1 / 3.0);
      const Geographic at = wgs84::from_ecef(middle).p;
      const double away = std::hypot((at.lon - p.lon) * 0.7, at.lat - p.lat);
      if (away < nearest) nearest = away, material = part.material;
    }
  return material;
}

std::shared_ptr<const LandCover> cover_of(const GeoRect& where, const Materials& said) {
  return with_materials(
      std::make_shared<test::MadeUpCover>(
          where, std::vector<CoverClass>{{10, "Trees"}, {20, "Rock"}, {30, "Sea"}}),
      said);
}

TEST(Bucket, IsOfTheMaterialsOfItsLandCoverAlsoOnFlatLand) {
  // Three stripes 1.9 km wide, and nothing known in the east; two triangles would do for the DEM.
  const MadeUpSource flat(HeightGrid(9, 9, 5), {9.9, 45.3}, 0.05);
  const auto cover = cover_of({10, 45, 10.072, 45.25}, {{10, "EvergreenForest"}});
  const auto all =
      make_all(plan_of(flat, 8), {bucket_at({10.05, 45.1}), bucket_at({10.05, 45.2})}, cover.get());
  ASSERT_EQ(all.size(), 2u);
  expect_no_cracks(all, {10, 45, 10.25, 45.25});
  EXPECT_GT(expect_errors(all, flat, {10, 45, 10.25, 45.25}), 0u);
  for (const Made& m : all) {
    EXPECT_LE(m.bucket.max_error_m, 8);
    EXPECT_LT(m.bucket.triangles, 6000u);
    const GeoRect r = rect(m.id);
    for (int k = 1; k < 20; ++k) {
      const double lat = r.south + k / 20. * r.height(), away = 0.0016;  // 126 m
      EXPECT_EQ(material_at(m.decoded, {10.012, lat}), "EvergreenForest") << lat;
      EXPECT_EQ(material_at(m.decoded, {10.024 - away, lat}), "EvergreenForest") << lat;
      EXPECT_EQ(material_at(m.decoded, {10.024 + away, lat}), "Rock") << lat;
      EXPECT_EQ(material_at(m.decoded, {10.048 - away, lat}), "Rock") << lat;
      EXPECT_EQ(material_at(m.decoded, {10.06, lat}), "Default") << "a class without a material";
      EXPECT_EQ(material_at(m.decoded, {10.2, lat}), "Default") << "beyond the raster";
    }
  }
}

TEST(Bucket, KeepsItsErrorUnderLandCover) {
  const MadeUpSource dem(test::rough_terrain(160, 160, 7, 900), {10, 45.13}, 1 / 1200.);
  const auto cover = cover_of({10, 45, 10.1, 45.125}, {{30, "Ocean"}});
  const auto all = make_all(plan_of(dem, 8), {bucket_at({10.05, 45.1})}, cover.get());
  ASSERT_EQ(all.size(), 1u);
  EXPECT_GT(expect_errors(all, dem, {10.001, 45.001, 10.124, 45.124}), 20000u);
  EXPECT_LE(all[0].bucket.max_error_m, 8);
  EXPECT_EQ(all[0].decoded.btg.parts.size(), 3u);
}

TEST(Bucket, AFailedReadIsAnError) {
  const MadeUpSource dem(test::rough_terrain(300, 300, 1), {10, 45.2}, 0.001);
  const BucketPlan plan = plan_of(dem);
  dem.reads_left = 0;
  const auto made = make_bucket(plan, bucket_at({10.1, 45.1}));
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, Errc::io);
  EXPECT_NE(made.error().what.find("bucket "), std::string::npos);
}

}  // namespace
}  // namespace tind::flightgear
