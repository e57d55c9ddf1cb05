// /refine over HTTP.

#include <gtest/gtest.h>

#include "proto/stream/refine_delta.h"
#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

const std::string kCamera = R"("camera":{"lon":-121.8,"lat":46.7,"height_m":3500,"pitch_deg":-8,
  "heading_deg":10,"width_px":800,"height_px":600,"tolerance_px":2})";

TEST_F(Api, AViewIsSentOnceAndThenOnlyWhatChanges) {
  add_dem();
  const HttpReply first = post("/refine/rainier", "{" + kCamera + "}");
  ASSERT_EQ(first.status, 200) << first.body;
  EXPECT_EQ(first.headers.at("content-type"), "application/vnd.tind.refined-mesh");
  const auto whole = proto::decode_refine_delta(first.body);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->whole);
  EXPECT_GT(whole->triangles.size(), 1000u);

  std::string further = kCamera;
  further.replace(further.find("46.7"), 4, "46.702");
  const HttpReply next =
      post("/refine/rainier", "{\"view\":\"" + whole->view + "\"," + further + "}");
  const auto delta = proto::decode_refine_delta(next.body);
  ASSERT_TRUE(delta) << next.body;
  EXPECT_FALSE(delta->whole);
  EXPECT_LT(next.body.size(), first.body.size() / 5);

  // Applied, it is the mesh that the server would send whole for that camera.
  std::map<std::uint32_t, std::array<std::uint32_t, 3>> held;
  for (const auto& t : whole->triangles) held[t.id] = t.corners;
  for (const auto id : delta->removed_triangles) EXPECT_EQ(held.erase(id), 1u);
  for (const auto& t : delta->triangles) EXPECT_TRUE(held.emplace(t.id, t.corners).second);
  const auto again = proto::decode_refine_delta(post("/refine/rainier", "{" + further + "}").body);
  EXPECT_NEAR(double(held.size()), double(again->triangles.size()), 0.1 * double(held.size()));

  const HttpReply used =
      post("/refine/rainier", "{\"view\":\"" + whole->view + "\"," + kCamera + "}");
  EXPECT_EQ(used.status, 404) << "a token stands for one view";
  EXPECT_EQ(refine_.views(), 2u);
}

TEST_F(Api, ARegionIsOneMesh) {
  add_dem();
  const HttpReply reply = post(
      "/refine/rainier",
      R"({"region":{"route":[[-121.9,46.7],[-121.7,46.9]],"width_m":2000},"inside_m":5,"outside_m":100})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto mesh = proto::decode_refine_delta(reply.body);
  ASSERT_TRUE(mesh && mesh->whole && mesh->view.empty());
  EXPECT_GT(mesh->triangles.size(), 500u);
}

TEST_F(Api, AMeshIsSentWithWhatItsDemSaysOfItsHeights) {
  DemOptions options;
  options.accuracy = VerticalAccuracy{AccuracyKind::rmse, 2.5};
  ASSERT_TRUE(
      services::open_dataset(catalog_, {"stated", {test::testdata("rainier.tif")}}, options, {}));
  add_dem();
  const std::string region =
      R"({"region":{"bbox":[-121.8,46.8,-121.7,46.9]},"inside_m":50,"outside_m":100})";
  const HttpReply stated = post("/refine/stated", region);
  ASSERT_EQ(stated.status, 200) << stated.body;
  EXPECT_EQ(stated.headers.at("tind-accuracy"), "rmse=2.5");
  EXPECT_EQ(stated.headers.at("access-control-expose-headers"), "Tind-Accuracy");
  EXPECT_FALSE(post("/refine/rainier", region).headers.contains("tind-accuracy"));
}

TEST_F(Api, ARegionMayBeLargerThanTheDem) {
  add_dem();
  for (const char* box : {"[-130,40,59,60]", "[-180,-90,180,90]", "[-179,-80,179,80]"}) {
    const HttpReply reply = post("/refine/rainier", std::string(R"({"region":{"bbox":)") + box +
                                                        R"(},"inside_m":20,"outside_m":80})");
    EXPECT_EQ(reply.status, 200) << box << reply.body.substr(0, 300);
  }
  const HttpReply beside =
      post("/refine/rainier", R"({"region":{"bbox":[1,2,3,4]},"inside_m":20,"outside_m":80})");
  EXPECT_EQ(beside.status, 400);
  const auto json = nlohmann::json::parse(beside.body);
  EXPECT_EQ(json["detail"], "the region lies outside the DEM");
  EXPECT_EQ(json["errors"][0]["parameter"], "region");
}

TEST_F(Api, WrongRefineRequestsSayWhatIsWrong) {
  add_dem();
  expect_refused(
      "/refine/rainier",
      {{"", "body"},
       {"[]", "body"},
       {"{}", "region"},
       {"{\"camera\":1}", "camera"},
       {"{\"camera\":{\"lon\":1e99,\"lat\":0,\"height_m\":0}}", "camera.lon"},
       {"{\"camera\":{\"lon\":1,\"lat\":0}}", "camera.height_m"},
       {"{" + kCamera + ",\"x\":1}", "x"},
       {"{" + kCamera + ",\"view\":7}", "view"},
       {R"({"region":{"bbox":[1,2,3,4],"bbox":[5,6,7,8]},"inside_m":1,"outside_m":2})", "bbox"},
       {"{" + kCamera + ",\"window\":[1,2,3]}", "window"},
       {"{" + kCamera + ",\"window\":[3,2,1,4]}", "window"},
       {"{" + kCamera + ",\"window\":[10,11,12,13]}", "window"},  // known to be empty only later
       {"{" + kCamera + ",\"window\":[1,2,3,4],\"view\":\"0123\"}", "window"},
       {R"({"region":{"bbox":[1,2,3]},"inside_m":1,"outside_m":2})", "region.bbox"},
       {R"({"region":{"bbox":[1,2,3,4]},"inside_m":3,"outside_m":2})", "inside_m"},
       {R"({"region":{"bbox":[1,2,3,4]},"outside_m":2})", "inside_m"},
       {R"({"region":{"polygon":[[1,2],[3,"4"]]},"inside_m":1,"outside_m":2})", "region.polygon"},
       {R"({"region":{"polygon":[[1,2],[3,4]]},"inside_m":1,"outside_m":2})", "region"},
       {R"({"region":{"route":[[1,2],[3,4]]},"inside_m":1,"outside_m":2})", "region.width_m"}});
  EXPECT_EQ(post("/refine/nothing", "{" + kCamera + "}").status, 404);
  EXPECT_EQ(post("/refine/made-up", "{" + kCamera + "}").status, 404) << "a store has no DEM";
  EXPECT_EQ(post("/refine/rainier", "{\"view\":\"00\"," + kCamera + "}").status, 404);
}

}  // namespace
}  // namespace tind::api
