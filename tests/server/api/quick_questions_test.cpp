// What may keep a worker for long is a batch and no question, and what is refused is not read
// first.

#include "server/api/elevation/lookups.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/pyramid/plan/flight_plan.h"
#include "tests/server/api/processes_fixture.h"
#include "tests/support/vast_source.h"

namespace tind::api {
namespace {

using services::Work;

/// `before`, n times `one` with `between`, `behind`.
std::string list(const std::string& before, int n, const std::string& one,
                 const std::string& between, const std::string& behind) {
  std::string text = before;
  for (int i = 0; i < n; ++i) text += (i == 0 ? "" : between) + one;
  return text + behind;
}

TEST(QuickQuestions, AreOfFewPlacesHoweverTheyAreWritten) {
  const auto texts = [](int n) {
    return std::vector{
        list("locations=", n, "46.85,-121.76", "|", "&interpolation=cubic"),
        list("locations=", n, "46.85%2C-121.76", "%7C", ""),
        list("locations=", n, "46.85%2c-121.76", "%7c", "&dataset=alps,world"),
        list(R"({"locations":[)", n, R"({"latitude":46.85,"longitude":-121.76})", ",", "]}"),
        list(R"({"range":true,"shape":[)", n, R"({"lat":46.85,"lon":-121.76})", ",", "]}"),
        list("locations=enc:", n, "_p~iF~ps|U", "", ""),
        list("locations=", n, "%5Fp~%69%46~ps%7C%55", "", ""),
        list(R"({"encoded_polyline":")", n, "_p~iF~ps|U", "", R"("})")};
  };
  for (const std::string& text : texts(1)) EXPECT_EQ(work_of(text), Work::question) << text;
  for (const std::string& text : texts(30)) EXPECT_EQ(work_of(text), Work::batch) << text;
  EXPECT_EQ(work_of(texts(16)[0]), Work::question);
  EXPECT_EQ(work_of(texts(16)[3]), Work::question);
}

TEST(QuickQuestions, MakeNoManyOfAFew) {
  for (const char* text :
       {"path=1,2|3,4&samples=500", "path=1,2|3,4&s%61mples=500",
        R"({"shape":[{"lat":1,"lon":2},{"lat":3,"lon":4}],"resample_distance":1})",
        R"({"shape":[{"lat":1,"lon":2},{"lat":3,"lon":4}],"re\u0073ample_distance":1})"})
    EXPECT_EQ(work_of(text), Work::batch) << text;
}

class QuickQuestionsOf : public Api {
 protected:
  void SetUp() override {
    add_dem();
    Dataset large = dataset_of(Surface(large_));
    large.tiles = std::make_shared<test::MadeUpTiles>(14);
    catalog_.add("large", large);
  }
  /// All places of the class.
  void fill_batches() {
    while (auto permit = pool_.admit(Work::batch)) held_.push_back(std::move(*permit));
  }
  int ask(const std::string& dataset, const std::string& type, const std::string& body) {
    HttpClient client(port());
    client.send("POST /elevation/" + dataset + " HTTP/1.1\r\nHost: h\r\nContent-Type: " + type +
                "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive().status;
  }

  std::shared_ptr<test::VastSource> large_ =
      std::make_shared<test::VastSource>(20'000, 20'000, Geographic{7, 46}, .0002);
  std::vector<services::CpuPool::Permit> held_;
};

TEST_F(QuickQuestionsOf, ALargeDemAreOfFewPlaces) {
  fill_batches();
  const auto json = [](int n) { return list(R"({"locations":[)", n, "[8.25,44.5]", ",", "]}"); };
  const auto csv = [](int n) { return list("lon,lat,name\n", n, "8.25,44.5,a", "\n", "\n"); };
  EXPECT_EQ(ask("large", "application/json", json(16)), 200);
  EXPECT_EQ(ask("large", "application/json", json(17)), 503);
  EXPECT_EQ(ask("large", "text/csv", csv(16)), 200);
  EXPECT_EQ(ask("large", "text/csv", csv(17)), 503);
  EXPECT_EQ(ask("rainier", "application/json", json(400)), 200) << "a few blocks are all of it";
  EXPECT_EQ(get("/elevation/large?lon=8.25&lat=44.5").status, 200);
  const auto points = [](int n) {
    return list("/collections/large/position?coords=MULTIPOINT(", n, "(8.25+44.5)", ",", ")");
  };
  EXPECT_EQ(get(points(16)).status, 200);
  EXPECT_EQ(get(points(17)).status, 503);
  EXPECT_EQ(get("/collections/large/trajectory?coords=LINESTRING(8+44,8.1+44)").status, 503);
}

TEST_F(QuickQuestionsOf, APlanOfTooManyTilesIsRefusedBeforeAllGroundIsRead) {
  Json fixes = Json::array();
  for (int i = 0; i < 3000; ++i)
    fixes.push_back({{"lon", 7 + i % 55 * .07},
                     {"lat", 42.1 + i / 55 * .07},
                     {"height_m", 1500},
                     {"time_s", i}});
  expect_refused("/plan/large",
                 {{Json{{"trajectory", fixes}, {"tolerance_px", .1}}.dump(), "tolerance_px"}});
  EXPECT_GT(large_->reads, 0);
  EXPECT_LT(large_->reads, 100);
}

TEST_F(QuickQuestionsOf, APlanIsOfTheHighestGroundAllTheSame) {
  Json fixes = Json::array();
  std::vector<FlightFix> flight;
  for (int i = 0; i < 300; ++i) {
    flight.push_back({{8 + i * .0011, 44}, 1100, double(i)});
    fixes.push_back(
        {{"lon", flight.back().where.lon}, {"lat", 44}, {"height_m", 1100}, {"time_s", i}});
  }
  Json body = {{"trajectory", fixes}, {"tolerance_px", 40}};
  const HttpReply reply = post("/plan/large", body.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Surface surface(large_);
  body["ground_m"] = *highest_ground(&surface, places_of(flight));
  EXPECT_EQ(post("/plan/large", body.dump()).body, reply.body);
}

TEST_F(ProcessesApi, LargeOrdersKeepNoQuestionWaiting) {
  std::vector<services::CpuPool::Permit> held;
  while (auto permit = pool_.admit(Work::batch)) held.push_back(std::move(*permit));
  const auto order = [](int n) { return inputs(list(R"("breaklines": [)", n, "0", ",", "]")); };
  EXPECT_EQ(execute(order(9)).status, 400);
  EXPECT_EQ(execute(order(9'000)).status, 503) << "reading it would take its time";
  held.clear();
  EXPECT_EQ(execute(order(9'000)).status, 400);
}

}  // namespace
}  // namespace tind::api
