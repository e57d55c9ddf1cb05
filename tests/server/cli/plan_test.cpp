#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "server/cli/options/trajectory_file.h"
#include "terrain/base/file_io.h"
#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using cli::parse_trajectory;

TEST(Trajectory, CsvAndGeoJsonSayTheSame) {
  const auto csv =
      parse_trajectory("# a flight\nTime,Lat,Lon,height_m\n10,46,-121,900\n40,47,-122,800\n", {});
  ASSERT_TRUE(csv) << csv.error().what;
  const auto marked = parse_trajectory("\xef\xbb\xbfTime,Lat,Lon\n10,46,-121\n40,47,-122\n", {});
  ASSERT_TRUE(marked) << marked.error().what;
  EXPECT_EQ(marked->at(1).time_s, csv->at(1).time_s);
  const auto plain = parse_trajectory("-121,46,900,10\r\n-122,47,800,40\r\n", {});
  ASSERT_TRUE(plain) << plain.error().what;
  const auto line = parse_trajectory(
      R"({"type": "LineString", "coordinates": [[-121, 46, 900, 10], [-122, 47, 800, 40]]})", {});
  ASSERT_TRUE(line) << line.error().what;
  const auto feature = parse_trajectory(
      R"({"type": "FeatureCollection", "features": [{"type": "Feature",
          "properties": {"times": [10, 40]}, "geometry":
          {"type": "LineString", "coordinates": [[-121, 46, 900], [-122, 47, 800]]}}]})",
      {});
  ASSERT_TRUE(feature) << feature.error().what;
  for (const auto* flight : {&*csv, &*plain, &*line, &*feature}) {
    ASSERT_EQ(flight->size(), 2u);
    EXPECT_EQ((*flight)[1].where, (Geographic{-122, 47}));
    EXPECT_EQ((*flight)[0].height_m, 900);
    EXPECT_EQ((*flight)[0].time_s, 10);
    EXPECT_EQ((*flight)[1].time_s, 40);
  }
}

TEST(Trajectory, DatesCountFromTheFirstAndASpeedMakesTimes) {
  const auto dates =
      parse_trajectory("1,2,3,2026-02-28T23:59:30Z\n1,2,3,2026-03-01T00:00:10.5Z\n", {});
  ASSERT_TRUE(dates) << dates.error().what;
  EXPECT_EQ((*dates)[0].time_s, 0);
  EXPECT_EQ((*dates)[1].time_s, 40.5);
  const auto speed = parse_trajectory("lon,lat\n0,0\n1,0\n", 100);
  ASSERT_TRUE(speed) << speed.error().what;
  EXPECT_NEAR((*speed)[1].time_s, 1113.195, 0.01);  // a degree of the equator
}

TEST(Trajectory, ReadsWhatOthersWrite) {
  const auto one = [](const char* text) {
    const auto flight = parse_trajectory(text, {});
    EXPECT_TRUE(flight) << flight.error().what;
    return flight && !flight->empty() ? flight->back() : FlightFix{};
  };
  EXPECT_EQ(one("lon,lat,altitude_m,time\n1,2,3,4\n").height_m, 3);
  EXPECT_EQ(one("x,y,z,lon,lat,alt,time,timestamp\n7,8,9,1,2,3,4,5\n").where.lat, 2);
  EXPECT_EQ(one("lon,lat,alt,time,z\n1,2,3,4,9\n").height_m, 3);
  EXPECT_EQ(one("1;2;3;4\n").height_m, 3);
  EXPECT_EQ(one("\"1.5\",\"2\",\"3\",\"4\"\n").where.lon, 1.5);
  EXPECT_EQ(one("1,2,3,1764345600\n1,2,3,1764345610\n").time_s, 1764345610);
  EXPECT_EQ(one("1,2,3,2026-01-01T00:00:00+01:00\n1,2,3,2025-12-31T23:00:30Z\n").time_s, 30);
  EXPECT_EQ(one("1,2,3,2026-01-01T00:00:00-00:30\n1,2,3,2026-01-01T00:31:00Z\n").time_s, 60);
}

TEST(Trajectory, TheWayBackTakesAsLong) {
  const auto seconds = [](const char* text) { return parse_trajectory(text, 250)->back().time_s; };
  const double there = seconds("-0.4,51.5,10000\n-118.4,33.9,10000\n");
  EXPECT_NEAR(seconds("-118.4,33.9,10000\n-0.4,51.5,10000\n"), there, 1e-6 * there);
  EXPECT_NEAR(seconds("0,0,0\n90,60,0\n"), 42690, 50);  // integrated finely
}

TEST(Trajectory, WhatIsWrongIsNamed) {
  const auto refused = [](const char* text, const char* why, std::optional<double> speed = {}) {
    const auto flight = parse_trajectory(text, speed);
    ASSERT_FALSE(flight) << text;
    EXPECT_NE(flight.error().what.find(why), std::string::npos) << flight.error().what;
  };
  refused("", "no fix");
  refused("a,b\n1,2\n", "line 1: no columns named lon and lat");
  refused("1,2,3,4\n1,x,3,5\n", "line 2: column 2 is no number");
  refused("1,2,3,4\n1,2,3\n", "line 2 has 3 columns, the first has 4");
  refused("lon,lat,height_ft,time\n1,2,16000,4\n", "none of these is known: height_ft");
  refused("lon,lat,altitude,elevation,time\n1,2,3,4,5\n", "say the same, altitude and elevation");
  refused("lon,lat,lon,alt,time\n1,2,3,4,5\n", "say the same, lon and lon");
  refused("7,05;45,99;5000\n", "line 1: no columns named lon and lat", 100);
  refused("7.05;45.99;5000\n7,06;46;5000\n", "line 2: column 1 is no number", 100);
  refused("1\n2\n", "line 1 is not lon,lat");
  refused("\"1,2\n3\",4,5,6\n", "line 1 has a quote that does not end");
  refused("1,2,3,2026-01-01T00:00:00+1:00\n", "is no time");
  refused("1,2,3,4\n1,2,3,soon\n", "line 2: 'soon' is no time");
  refused("1,2,3,4\n1,99,3,5\n", "fix 1 is not on earth");
  refused("1,2,3\n1,3,3\n", "no times");
  refused("1,2,3,4\n", "needs no speed", 5);
  refused("{\"type\": \"Point\"}", "no LineString");
  refused("{\"type\": \"LineString\", \"coordinates\": [[1]]}", "fix 0 must be");
}

TEST(Plan, ListsTilesWithTheirDeadlines) {
  const std::string dem = test::testdata("rainier.tif");
  const auto run = [&](const std::string& more) {
    const auto got = test::run_tind("plan " + dem + " --tolerance 32 --json " + more);
    EXPECT_EQ(got.code, 0) << got.out;
    return nlohmann::json::parse(got.answer);
  };
  const std::string flight = "--position=-121.8,46.8,5000 --velocity=250,0,0 --horizon 60";
  const auto slow = run(flight + " --link 0.1");
  ASSERT_GT(slow.at("tiles").size(), 4u);
  EXPECT_EQ(slow.at("seconds"), 60);
  EXPECT_GT(slow.at("late_tiles"), 0);
  EXPECT_GE(slow.at("lead_s"), slow.at("most_late_s"));
  double last = -1;
  for (const auto& t : slow.at("tiles")) {
    EXPECT_GE(t.at("needed_s"), last);
    last = t.at("needed_s");
    EXPECT_NEAR(t.at("late_s").get<double>(), std::max(0.0, t.at("arrives_s").get<double>() - last),
                1e-9);
  }
  const auto early = run(flight + " --link 0.1 --head-start " +
                         std::to_string(slow.at("lead_s").get<double>() + 1));
  EXPECT_EQ(early.at("late_tiles"), 0);

  // The same flight as a file, over a directory, whose tiles have their own sizes.
  const test::TempDir dir;
  const std::string tiles = dir.file("tiles"), file = dir.file("flight.csv");
  ASSERT_EQ(test::run_tind("build " + dem + " -o " + tiles + " --levels 0-9 --progress none").code,
            0);
  ASSERT_TRUE(
      write_whole_file(file, "lon,lat,height,time\n-121.8,46.8,5000,0\n-121.6,46.8,5000,60\n"));
  const auto stored =
      test::run_tind("plan " + tiles + " --trajectory " + file + " --tolerance 32 --json");
  ASSERT_EQ(stored.code, 0) << stored.out;
  const auto plan = nlohmann::json::parse(stored.answer);
  const auto unheard = [&](const std::string& more) {
    const auto got = test::run_tind("plan " + tiles + " " + more);
    EXPECT_EQ(got.code, 2) << more << got.out;
    EXPECT_NE(got.out.find("leave it out"), std::string::npos) << got.out;
  };
  unheard("--trajectory " + file + " --velocity=1,2,3");
  unheard("--trajectory " + file + " --horizon 5");
  unheard(flight + " --speed 40");
  unheard(flight + " --max-error 3");
  unheard(flight + " --nodata 5");
  std::set<int> sizes;
  for (const auto& t : plan.at("tiles")) sizes.insert(t.at("bytes").get<int>());
  EXPECT_GT(sizes.size(), 1u);
}

TEST(Plan, SaysWhatIsMissing) {
  const std::string dem = test::testdata("rainier.tif");
  for (const char* wrong : {"", "--position=1,2,3", "--trajectory a.csv --position=1,2,3"})
    EXPECT_EQ(test::run_tind("plan " + dem + " " + wrong).code, 2) << wrong;
  EXPECT_EQ(test::run_tind("plan " + dem + " --trajectory nothing.csv").code, 69);
  EXPECT_EQ(test::run_tind("plan " + dem + " --position=1,2,3 --velocity=1,1,1 --link 0").code, 2);
}

}  // namespace
}  // namespace tind
