// Selective and view-dependent refinement, judged by the referees post by post.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/progressive/multires/levelled_collapse.h"
#include "terrain/progressive/multires/post_error.h"
#include "terrain/progressive/multires/refine_region.h"
#include "terrain/progressive/multires/view_front.h"
#include "tests/support/support.h"
#include "tests/support/text_dem.h"
#include "tests/terrain/progressive/posts_in_view.h"

namespace tind {
namespace {

using Index = Front::Index;

/// One valid mesh that covers the grid exactly; area in posts.
void expect_whole(const Tin& tin, const HeightGrid& grid) {
  const MeshValidity v = check_validity(tin);
  EXPECT_TRUE(v.ok()) << v.first_problem;
  EXPECT_NEAR(v.area, double(grid.cols() - 1) * (grid.rows() - 1), 1e-6 * v.area);
  EXPECT_EQ(vertical_error(tin, grid).uncovered, 0u);
}

Tin finest(const MultiTriangulation& all) {
  return refine_region(all, Region::polygon({{-9, 9}, {9e5, 9}, {9e5, -9e5}, {-9, -9e5}}), {0, 0})
      .to_tin();
}

class Levelled : public ::testing::Test {
 protected:
  HeightGrid grid_ = test::rough_terrain(97, 73, 5);
  MultiTriangulation all_ = *levelled_terrain({grid_, 30, 25}, {.base_triangles = 20});
};

TEST_F(Levelled, FromCoarseToTheWholeGridWithoutError) {
  const Tin base = Front(all_).to_tin();
  EXPECT_LE(base.triangles.size(), 400u);
  expect_whole(base, grid_);
  const Tin fine = finest(all_);
  EXPECT_EQ(fine.triangles.size(), 2u * 96 * 72);
  EXPECT_EQ(vertical_error(fine, grid_).max_m, 0);
  expect_whole(fine, grid_);
}

TEST_F(Levelled, DoesNotDependOnThreads) {
  const MultiTriangulation again =
      *levelled_terrain({grid_, 30, 25}, {.base_triangles = 20, .threads = 3});
  ASSERT_EQ(again.triangles(), all_.triangles());
  for (Index t = 0; t < all_.triangles(); ++t) {
    ASSERT_EQ(again.corners(t), all_.corners(t));
    ASSERT_EQ(again.error_m(t), all_.error_m(t));
  }
}

TEST_F(Levelled, AnySetOfNodesWithTheirParentsIsAValidMesh) {
  std::mt19937 random(7);
  for (int round = 0; round < 30; ++round) {
    Front front(all_);
    for (int i = 0; i < 40 * round; ++i) front.apply(Index(random() % all_.nodes()), [](Index) {});
    for (int i = 0; i < 400; ++i)  // and back, where nothing hangs on it
      if (const Index n = Index(random() % all_.nodes()); front.applied(n) && front.leaf(n))
        front.take_back(n);
    const Tin tin = front.to_tin();
    EXPECT_EQ(tin.triangles.size(), front.triangle_count());
    expect_whole(tin, grid_);
    double stated = 0;
    for (const Index t : front.active_triangles()) {
      EXPECT_TRUE(front.active(t));
      stated = std::max(stated, double(all_.error_m(t)));
    }
    EXPECT_EQ(float_above(vertical_error(tin, grid_).max_m), float(stated)) << "exact, not a bound";
  }
}

TEST_F(Levelled, ChangesLeadFromOneMeshToTheNext) {
  std::mt19937 random(8);
  Front front(all_);
  std::vector<Index> held;  // what a client has
  for (Index t = all_.base_begin(); t < all_.triangles(); ++t) held.push_back(t);
  std::vector<Index> vertices = all_.base_vertices();
  for (int round = 0; round < 60; ++round) {
    for (int i = 0; i < 30; ++i) front.apply(Index(random() % all_.nodes()), [](Index) {});
    for (int i = 0; i < 6000; ++i)
      if (const Index n = Index(random() % all_.nodes()); front.applied(n) && front.leaf(n))
        front.take_back(n);
    const FrontChange change = front.take_change();
    const auto apply = [](std::vector<Index>& to, const std::vector<Index>& gone,
                          const std::vector<Index>& come) {
      ASSERT_TRUE(std::includes(to.begin(), to.end(), gone.begin(), gone.end()));
      std::vector<Index> left, next;
      std::set_difference(to.begin(), to.end(), gone.begin(), gone.end(), std::back_inserter(left));
      std::merge(left.begin(), left.end(), come.begin(), come.end(), std::back_inserter(next));
      ASSERT_EQ(std::adjacent_find(next.begin(), next.end()), next.end());
      to = next;
    };
    apply(held, change.removed_triangles, change.added_triangles);
    apply(vertices, change.removed_vertices, change.added_vertices);
    auto expected = front.active_triangles();
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(held, expected);
    for (const Index t : held)
      for (const Index v : all_.corners(t))
        ASSERT_TRUE(std::binary_search(vertices.begin(), vertices.end(), v));
  }
}

TEST_F(Levelled, VoidsStayUncovered) {
  HeightGrid grid = test::rough_terrain(60, 50, 2);
  for (int r = 20; r < 30; ++r)
    for (int c = 5; c < 30; ++c) grid.at(c, r) = HeightGrid::kVoid;
  const MultiTriangulation all = *levelled_terrain({grid, 30, 30}, {.base_triangles = 10});
  EXPECT_EQ(vertical_error(Front(all).to_tin(), grid).uncovered, 0u);
  EXPECT_TRUE(check_validity(Front(all).to_tin()).ok());
  EXPECT_EQ(vertical_error(finest(all), grid).max_m, 0);
}

TEST_F(Levelled, StopsWhenAskedAndRefusesNoGrid) {
  std::stop_source stop;
  stop.request_stop();
  const auto stopped =
      levelled_terrain({grid_, 1, 1}, {}, {.report = {}, .stop = stop.get_token()});
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  EXPECT_EQ(levelled_terrain({HeightGrid(1, 1, 0), 1, 1}).error().code, Errc::bad_data);
  EXPECT_EQ(levelled_terrain({HeightGrid(9, 9), 1, 1}).error().code, Errc::bad_data);
}

/// Post by post: what the region says is what each post has.
void expect_region(const Tin& tin, const HeightGrid& grid, const Region& region,
                   const RegionErrors& errors) {
  expect_whole(tin, grid);
  HeightGrid inside = grid, outside = grid;
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c)
      (region.contains({double(c), -double(r)}) ? outside : inside).at(c, r) = HeightGrid::kVoid;
  EXPECT_LE(vertical_error(tin, inside).max_m, errors.inside_m);
  EXPECT_LE(vertical_error(tin, outside).max_m, errors.outside_m);
}

TEST_F(Levelled, TheBoundsOfARegionHoldOverEveryPost) {
  const Region regions[] = {
      Region::polygon({{20, -10}, {50, -10}, {50, -40}, {20, -40}}),
      Region::polygon({{10.5, -60.2}, {80.1, -66}, {90, -5.5}, {60, -30}, {31, -3}}),
      Region::corridor({{-5, -70}, {40, -30}, {95, -35}}, 90, 30, 25),
      Region::corridor({{30.3, -30.3}, {30.4, -30.3}}, 1, 30, 25),
  };
  for (const Region& region : regions)
    for (const RegionErrors& errors : {RegionErrors{2, 60}, {0, 1e9}, {20, 40}, {50, 50}})
      expect_region(refine_region(all_, region, errors).to_tin(), grid_, region, errors);
  EXPECT_TRUE(regions[1].contains({40, -15}) && regions[2].contains({40, -30}));
  EXPECT_FALSE(regions[1].contains({2, -2}) || regions[2].contains({0, 0}));
  const std::size_t near = refine_region(all_, regions[0], {2, 60}).triangle_count();
  const std::size_t all = refine_region(all_, regions[0], {2, 2}).triangle_count();
  EXPECT_LT(near, all / 2) << "what lies outside stays coarse";
}

TEST(Region, KnowsWhichTrianglesHoldAnyOfItsPosts) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> at(0, 20);
  for (int round = 0; round < 3000; ++round) {
    const Vec2 p[3] = {
        {at(random), -at(random)}, {at(random), -at(random)}, {at(random), -at(random)}};
    const Region region = round % 2 ? Region::polygon({p[0], p[1], p[2]})
                                    : Region::corridor({p[0], p[1], p[2]}, at(random) * 3, 2, 3);
    Vec3 t[3];
    for (Vec3& v : t) v = {std::round(at(random)), -std::round(at(random)), 0};
    if (orient2d(t[0], t[1], t[2]) < 0) std::swap(t[0], t[1]);
    if (orient2d(t[0], t[1], t[2]) == 0) continue;
    if (region.touches(t[0], t[1], t[2])) continue;
    for (int r = 0; r <= 20; ++r)
      for (int c = 0; c <= 20; ++c) {
        const Vec3 q{double(c), -double(r), 0};
        const bool in_triangle = orient2d(t[0], t[1], q) >= 0 && orient2d(t[1], t[2], q) >= 0 &&
                                 orient2d(t[2], t[0], q) >= 0;
        ASSERT_FALSE(in_triangle && region.contains({q.x, q.y}));
      }
  }
}

class Views : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    dem_ = *DemSource::open(std::vector{test::testdata("rainier.tif")});
    const DemInfo& info = dem_->info();
    grid_ = *dem_->read(0, 0, int(info.cols), int(info.rows));
    all_ = *levelled_terrain({grid_, info.spacing_x_m, info.spacing_y_m});
    geometry_ = *view_geometry(all_, *dem_);
    places_ = test::post_places(grid_, info.post_to_crs);
  }
  // Not left to the end of the program: PROJ may be gone by then, and a closing raster asks it.
  static void TearDownTestSuite() { dem_ = nullptr; }
  static test::InView seen(const Front& front, const Camera& camera) {
    return test::look_at_posts(front.to_tin(), grid_, places_, dem_->info().post_to_crs, camera);
  }

  static inline std::shared_ptr<const DemSource> dem_;
  static inline HeightGrid grid_;
  static inline MultiTriangulation all_;
  static inline ViewGeometry geometry_;
  static inline std::vector<Vec3> places_;
};

TEST_F(Views, EveryPostInViewIsDrawnWithinTheTolerance) {
  std::mt19937 random(11);
  std::size_t posts = 0;
  for (int i = 0; i < 40; ++i) {
    Camera camera = test::random_camera(grid_, dem_->info().post_to_crs, random);
    camera.tolerance_px = 0.5 + i % 4;
    ViewFront view(all_, geometry_);
    view.look(camera);
    const test::InView in = seen(view.front(), camera);
    EXPECT_LE(in.worst_px, camera.tolerance_px) << i;
    posts += in.posts;
    const MeshValidity valid = check_validity(view.front().to_tin());
    EXPECT_TRUE(valid.ok()) << valid.first_problem;
    EXPECT_NEAR(valid.area, check_validity(Front(all_).to_tin()).area, 1e-6 * valid.area);
  }
  EXPECT_GT(posts, 100000u);
}

TEST_F(Views, FollowingACameraKeepsThePromiseAndIsNotMuchLarger) {
  Camera camera;
  camera.position = {-121.9, 46.7};
  camera.height_m = 3500, camera.heading_deg = 50, camera.pitch_deg = -8;
  ViewFront follows(all_, geometry_);
  double followed = 0, anew = 0;
  for (int frame = 0; frame < 300; ++frame) {
    camera.position.lon += 250.0 / 10 / 76000;  // ten a second, eastwards
    camera.heading_deg += 0.3;
    camera.roll_deg = 20 * std::sin(0.05 * frame);
    follows.look(camera);
    if (frame % 20 != 19) continue;
    EXPECT_LE(seen(follows.front(), camera).worst_px, camera.tolerance_px) << frame;
    ViewFront scratch(all_, geometry_);
    scratch.look(camera);
    followed += double(follows.front().triangle_count());
    anew += double(scratch.front().triangle_count());
  }
  EXPECT_LE(followed, 1.15 * anew);
  camera.tolerance_px = 3;  // another lens: everything is looked at again
  follows.look(camera);
  EXPECT_LE(seen(follows.front(), camera).worst_px, 3);
}

TEST_F(Views, SilhouettesAreFiner) {
  Camera camera;
  camera.position = {-121.76, 46.7};
  camera.height_m = 2500, camera.pitch_deg = 2, camera.tolerance_px = 4;
  ViewFront plain(all_, geometry_), edged(all_, geometry_);
  plain.look(camera);
  camera.silhouette_px = 1;
  edged.look(camera);
  EXPECT_GT(edged.front().triangle_count(), plain.front().triangle_count());
  EXPECT_LE(seen(edged.front(), camera).worst_px, 4);
}

TEST(ViewGeometry, AcrossTheAntimeridianIsWhatItIsElsewhere) {
  const test::TempDir folder;
  const HeightGrid grid = test::rough_terrain(60, 60, 4);
  const auto geometry = [&](const char* name, double west) {
    const auto dem = test::text_dem(folder, name, grid, {west, 10}, .004);
    const auto posts = dem->read(0, 0, 60, 60);
    const auto all = levelled_terrain({*posts, dem->info().spacing_x_m, dem->info().spacing_y_m});
    EXPECT_TRUE(all) << all.error().what;
    return *view_geometry(*all, *dem);
  };
  const ViewGeometry across = geometry("across", 179.9), elsewhere = geometry("elsewhere", 100);
  EXPECT_NEAR(across.extent_m, elsewhere.extent_m, .1);
  ASSERT_EQ(across.position.size(), elsewhere.position.size());
  for (std::size_t i = 0; i < across.position.size(); ++i) {
    const auto &p = across.position[i], &q = elsewhere.position[i];
    EXPECT_NEAR(length(Vec3{p[0] - q[0], p[1] - q[1], p[2] - q[2]}), 0, .05);
  }
}

TEST(ViewGeometry, ADemWithoutAPlaceOnTheEarthIsRefused) {
  const auto dem = DemSource::open(std::vector{test::testdata("crater.tif")});
  ASSERT_TRUE(dem);
  if ((*dem)->info().crs_kind != CrsKind::none) GTEST_SKIP() << "crater.tif has a CRS";
  const auto grid = (*dem)->read(0, 0, 30, 30);
  const auto all = levelled_terrain({*grid, 10, 10});
  EXPECT_EQ(view_geometry(*all, **dem).error().code, Errc::unsupported);
}

}  // namespace
}  // namespace tind
