#include "server/services/refine/refine_service.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <new>
#include <vector>

#include "server/services/datasets/open_dataset.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/geo/ellipsoid.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(RefineService, IsBoundedInPostsAndViews) {
  services::Catalog catalog;
  ASSERT_TRUE(
      services::open_dataset(catalog, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  const services::ServedDataset& dataset = *catalog.find("rainier");
  Camera camera;
  camera.position = {-121.8, 46.7};
  camera.height_m = 9000, camera.pitch_deg = -40, camera.tolerance_px = 50;
  services::RefineService small({.posts = 1000});
  const auto refused = small.view(dataset, camera, "", {}, {});
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_NE(refused.error().what.find("at most 1000"), std::string::npos);

  services::RefineService service({.views = 3});
  std::vector<std::string> tokens;
  for (int i = 0; i < 5; ++i) tokens.push_back(service.view(dataset, camera, "", {}, {})->view);
  EXPECT_EQ(service.views(), 3u);
  EXPECT_EQ(service.view(dataset, camera, tokens[0], {}, {}).error().code, Errc::not_found);
  EXPECT_TRUE(service.view(dataset, camera, tokens[4], {}, {}));
  services::RefineService forgets({.view_age = std::chrono::seconds(-1)});
  const auto first = forgets.view(dataset, camera, "", {}, {});
  EXPECT_EQ(forgets.view(dataset, camera, first->view, {}, {}).error().code, Errc::not_found);
}

services::ServedDataset const& add_rainier(services::Catalog& catalog) {
  EXPECT_TRUE(
      services::open_dataset(catalog, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  return *catalog.find("rainier");
}

Camera far_off() {
  Camera camera;
  camera.position = {-121.8, 46.7};
  camera.height_m = 9000, camera.pitch_deg = -40, camera.tolerance_px = 50;
  return camera;
}

TEST(RefineService, WhoMakesManyViewsTakesNoOthers) {
  services::Catalog catalog;
  const services::ServedDataset& dataset = add_rainier(catalog);
  services::RefineService service({.views = 8});
  const auto look = [&](const std::string& token, const std::string& client) {
    const auto view = service.view(dataset, far_off(), token, {}, {}, client);
    return view ? view->view : std::string();
  };
  std::string own = look("", "me");
  for (int i = 0; i < 20; ++i) look("", "flood");
  own = look(own, "me");
  EXPECT_FALSE(own.empty());
  // From one address (behind a proxy) nobody is told from another: what was asked for again stays.
  for (int i = 0; i < 20; ++i) look("", "me");
  EXPECT_FALSE(look(own, "me").empty());
  EXPECT_EQ(service.views(), 8u);
}

TEST(RefineService, WhoMovesItsWindowAboutTakesNoOthersScene) {
  services::Catalog catalog;
  const services::ServedDataset& dataset = add_rainier(catalog);
  services::RefineService service({.scenes = 2});
  const auto look = [&](const std::string& token, double west, const std::string& client) {
    const auto view = service.view(dataset, far_off(), token,
                                   GeoRect{west, 46.75, west + 0.03, 46.8}, {}, client);
    EXPECT_TRUE(view) << view.error().what;
    return view ? view->view : std::string();
  };
  std::string own = look("", -121.90, "me");
  for (int i = 0; i < 5; ++i) look("", -121.85 + 0.03 * i, "flood");
  own = look(own, -121.90, "me");
  EXPECT_FALSE(own.empty());
  // Who wants two, where others have one each, loses the first.
  const std::string second = look("", -121.80, "me");
  EXPECT_FALSE(service.view(dataset, far_off(), own, {}, {}, "me"));
  EXPECT_FALSE(look("", -121.85, "other").empty());
  EXPECT_FALSE(look(second, -121.80, "me").empty());
}

/// A DEM that cannot always be read.
class ThrowingSource : public test::MadeUpSource {
 public:
  using MadeUpSource::MadeUpSource;
  mutable std::atomic<bool> throws{false};
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    if (throws.exchange(false)) throw std::bad_alloc();
    return MadeUpSource::read(col, row, cols, rows);
  }
};

TEST(RefineService, AnExceptionIsForgotten) {
  HeightGrid grid(80, 80, 100);
  grid.at(40, 40) = 300;
  const auto source = std::make_shared<ThrowingSource>(grid, Geographic{7, 46}, 0.01);
  services::Catalog catalog;
  const services::ServedDataset& dataset = catalog.add("d", *dem_dataset(source, {}));
  services::RefineService service;
  Camera camera = far_off();
  camera.position = {7.4, 45.6};
  EXPECT_FALSE(service.ready(dataset, {}));
  source->throws = true;
  EXPECT_THROW((void)service.view(dataset, camera, "", {}, {}), std::bad_alloc);
  const auto again = service.view(dataset, camera, "", {}, {});
  EXPECT_TRUE(again) << again.error().what;
  EXPECT_TRUE(service.ready(dataset, {}));
}

TEST(RefineService, PreparingStopsWhenToldTo) {
  services::Catalog catalog;
  const services::ServedDataset& dataset = add_rainier(catalog);
  services::RefineService service;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(service.view(dataset, far_off(), "", {}, stop.get_token()).error().code,
            Errc::cancelled);
  EXPECT_TRUE(service.view(dataset, far_off(), "", {}, {}));
}

TEST(RefineService, TakesWindowsOfWhatIsTooLarge) {
  services::Catalog catalog;
  ASSERT_TRUE(
      services::open_dataset(catalog, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  const services::ServedDataset& dataset = *catalog.find("rainier");
  services::RefineService service({.posts = 100'000});
  Camera camera;
  camera.position = {-121.8, 46.7};
  camera.height_m = 9000, camera.pitch_deg = -40, camera.tolerance_px = 20;
  const GeoRect south{-121.85, 46.65, -121.7, 46.75}, north{-121.85, 46.85, -121.7, 46.95};
  const auto refused = service.view(dataset, camera, "", {}, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("window"), std::string::npos) << refused.error().what;
  EXPECT_EQ(service.view(dataset, camera, "", dataset.source->info().bounds, {}).error().code,
            Errc::invalid_argument);
  EXPECT_EQ(service.view(dataset, camera, "", GeoRect{10, 10, 11, 11}, {}).error().code,
            Errc::invalid_argument);

  const auto reach = [](const proto::RefineDelta& mesh) {  // metres from its middle
    float most = 0;
    for (const auto& v : mesh.vertices) most = std::max(most, std::hypot(v.at[0], v.at[1]));
    return most;
  };
  const auto first = service.view(dataset, camera, "", south, {});
  ASSERT_TRUE(first) << first.error().what;
  EXPECT_NEAR(first->lat, 46.70, 0.03);
  EXPECT_GT(first->triangles.size(), 100u);
  EXPECT_LT(reach(*first), 15'000);
  const auto next = service.view(dataset, camera, first->view, {}, {});
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->whole);

  // A region brings its own window, of which every post is within the error that was asked for.
  const auto region = service.region(dataset, GeoRegion::box(north), {0, 50}, {}, {});
  ASSERT_TRUE(region) << region.error().what;
  EXPECT_NEAR(region->lat, 46.9, 0.03);
  const DemSource& dem = *dataset.source->only();
  const auto in_window = service.region(dataset, GeoRegion::box(north), {0, 50}, north, {});
  ASSERT_TRUE(in_window) << in_window.error().what;
  for (const Geographic p : {Geographic{-121.8, 46.9}, {-121.75, 46.87}, {-121.72, 46.93}}) {
    // With no error at all inside, the post nearest to the place is a vertex.
    std::vector<Vec2> post(1);
    dem.to_post(std::vector{p}, post);
    post[0] = {std::round(post[0].x), std::round(post[0].y)};
    std::vector<Geographic> at(1);
    dem.to_geographic(post, at);
    const auto height = height_at(dem, at[0]);
    ASSERT_TRUE(height);
    const LocalFrame frame = LocalFrame::at({in_window->lon, in_window->lat});
    const Vec3 place = frame.from_ecef(wgs84::to_ecef(at[0], height->height_m));
    double nearest = HUGE_VAL;
    for (const auto& v : in_window->vertices)
      nearest =
          std::min(nearest, std::hypot(v.at[0] - place.x, v.at[1] - place.y, v.at[2] - place.z));
    EXPECT_LT(nearest, 0.1);
  }
  // Two windows are ready at a time: the first view's has gone, and the view with it.
  EXPECT_EQ(service.view(dataset, camera, next->view, {}, {}).error().code, Errc::not_found);
}

}  // namespace
}  // namespace tind
