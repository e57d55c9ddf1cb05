// The program itself: the analyses of a TIN in place of a DEM (--posts), against what paper says of
// a plane and of a pyramid.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using nlohmann::json;
using test::Ran;
using test::run_tind;
using test::TempDir;
using test::testdata;
using test::tind_json;
using testing::HasSubstr;

// UTM zone 33: on its meridian, where the grid runs north.
constexpr double kEast = 500000, kNorth = 5000000;

std::string vertex(double x, double y, double z) {
  std::ostringstream out;
  out.precision(12);
  out << kEast + x << " " << kNorth + y << " " << z << "\n";
  return out.str();
}

/// A PLY of five vertices and four triangles: 400 m a side, `top` in its middle.
std::string pyramid(const TempDir& dir, const std::string& name, double top, double base = 0) {
  const std::string path = dir.file(name);
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\ncomment crs: EPSG:32633\nelement vertex 5\n"
         "property double x\nproperty double y\nproperty double z\nelement face 4\n"
         "property list uchar int vertex_indices\nend_header\n"
      << vertex(0, 0, base) << vertex(400, 0, base) << vertex(400, 400, base)
      << vertex(0, 400, base) << vertex(200, 200, base + top)
      << "3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
  return path;
}

/// An OBJ, which says nothing of where it is: z = x / 10 over 400 m x 200 m.
std::string plane(const TempDir& dir) {
  const std::string path = dir.file("plane.obj");
  std::ofstream out(path);
  out << "v " << vertex(0, 0, 0) << "v " << vertex(400, 0, 40) << "v " << vertex(400, 200, 40)
      << "v " << vertex(0, 200, 0) << "f 1 2 3\nf 1 3 4\n";
  return path;
}

/// The numbers of an Esri ASCII grid after its head.
std::vector<double> grid_values(const std::string& path) {
  std::ifstream in(path);
  std::vector<double> values;
  for (std::string word; in >> word;) {
    if (std::isalpha(static_cast<unsigned char>(word[0]))) {
      in >> word;
      continue;
    }
    values.push_back(std::stod(word));
  }
  return values;
}

const std::string kUtm = " --crs EPSG:32633";

TEST(TinAnalyses, SlopeAndAspectOfAPlaneAreItsOwn) {
  const TempDir dir;
  const std::string tin = plane(dir);
  const std::string out = dir.file("out.asc");
  const json said = tind_json("slope " + tin + kUtm + " --posts 10 --percent --json -o " + out);
  EXPECT_EQ(said["cols"], 41);
  EXPECT_EQ(said["rows"], 21);
  const auto slopes = grid_values(out);
  ASSERT_EQ(slopes.size(), 41u * 21u);
  for (const double s : slopes) EXPECT_NEAR(s, 10, 1e-3);
  tind_json("aspect " + tin + kUtm + " --posts 50 --json -o " + out);
  for (const double a : grid_values(out)) EXPECT_NEAR(a, 270, 1e-3);  // it falls to the west
  tind_json("roughness " + tin + kUtm + " --posts 50 --json -o " + out);
  for (const double r : grid_values(out))
    EXPECT_TRUE(std::abs(r - 10) < 1e-3 || std::abs(r - 5) < 1e-3);
}

TEST(TinAnalyses, ALineOverAPyramidGoesOverItsTop) {
  const TempDir dir;
  const std::string tin = pyramid(dir, "p.ply", 100);
  const std::string line = " --places-crs EPSG:32633 --line \"500000,5000200 500400,5000200\"";
  const json made = tind_json("profile " + tin + " --posts 100 --samples 5 --format json" + line);
  const double heights[] = {0, 50, 100, 50, 0};
  ASSERT_EQ(made["points"].size(), 5u) << made.dump();
  for (std::size_t i = 0; i < 5; ++i) {
    // The surface between posts 100 m apart is 100 / 2 / 4 = 12.5 m off at most: at posts it is
    // not.
    EXPECT_NEAR(made["points"][i]["height_m"].get<double>(), heights[i], 0.01) << i;
  }
  EXPECT_THAT(
      run_tind("profile " + tin + " --posts 100 --samples 5" + line).out,
      HasSubstr("5 x 5 posts, 100 x 100 m apart; the surface between them is within 12.5 m"));
}

TEST(TinAnalyses, AVolumeHoldsThatOfThePyramid) {
  const TempDir dir;
  const std::string tin = pyramid(dir, "p.ply", 100);
  const double true_m3 = 400.0 * 400.0 * 100 / 3;
  const json coarse = tind_json("volume " + tin + " --height 0 --posts 200 --json");
  // Four cells of 200 m, each with one corner up: 100 / 4 in the mean.
  EXPECT_NEAR(coarse["cut"]["m3"].get<double>(), 400.0 * 400.0 * 25, 1);
  EXPECT_NEAR(coarse["uncertainty_m"].get<double>(), 25, 1e-3);
  EXPECT_NEAR(coarse["area_m2"].get<double>(), 160000, 1e-3);
  const json fine = tind_json("volume " + tin + " --height 0 --posts 1 --json");
  EXPECT_NEAR(fine["uncertainty_m"].get<double>(), 0.125, 1e-3);  // 100 / 200 / 4
  EXPECT_NEAR(fine["cut"]["m3"].get<double>(), true_m3, 0.125 * 160000);
  for (const json* made : {&coarse, &fine}) {
    EXPECT_LE((*made)["cut"]["low_m3"].get<double>(), true_m3);
    EXPECT_GE((*made)["cut"]["high_m3"].get<double>(), true_m3);
  }
}

TEST(TinAnalyses, AgainstAnotherTinBothAreWhatIsUncertain) {
  const TempDir dir;
  const std::string tin = pyramid(dir, "p.ply", 100), lower = pyramid(dir, "lower.ply", 100, -5);
  const json made = tind_json("volume " + tin + " --against " + lower + " --posts 50 --json");
  EXPECT_NEAR(made["cut"]["m3"].get<double>(), 160000 * 5, 1);
  EXPECT_NEAR(made["uncertainty_m"].get<double>(), 2 * 6.25, 1e-3);
  const json less = tind_json("difference " + tin + " --less " + lower + " --posts 50 --json -o " +
                              dir.file("d.asc"));
  EXPECT_EQ(less["posts"], 81);
  EXPECT_NEAR(less["min_m"].get<double>(), 5, 1e-4);
  EXPECT_NEAR(less["max_m"].get<double>(), 5, 1e-4);
}

TEST(TinAnalyses, WithoutPostsTheTinItselfIsAsked) {
  const TempDir dir;
  const std::string tin = pyramid(dir, "p.ply", 100);
  const json all = tind_json("volume " + tin + " --height 50 --json");
  EXPECT_NEAR(all["cut"]["m3"].get<double>(), 200.0 * 200 * 50 / 3, 0.01);
  EXPECT_EQ(all["uncertainty_m"], 0);
  EXPECT_NEAR(all["area_scale"]["greatest"].get<double>(), 0.9996 * 0.9996, 1e-5);
  const json plane_less = tind_json(
      "volume " + plane(dir) + kUtm +
      " --places-crs EPSG:32633 --plane \"500000,5000000,10 500400,5000000,50 500000,5000200,10\" "
      "--json");
  EXPECT_NEAR(plane_less["fill"]["m3"].get<double>(), 400.0 * 200 * 10, 1);
  EXPECT_EQ(plane_less["cut"]["m3"], 0);
  const json line = tind_json("profile " + tin +
                              " --format json --places-crs EPSG:32633 "
                              "--line \"500000,5000100 500400,5000100\"");
  ASSERT_EQ(line["points"].size(), 4u) << line.dump();
  const double heights[] = {0, 50, 50, 0};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(line["points"][i]["height_m"].get<double>(), heights[i], 0.001);
  EXPECT_FALSE(line.contains("max_error_m"));
  const json at =
      tind_json("elevation " + tin +
                " --places-crs EPSG:32633 --at 500200,5000100 --at 499000,5000100 --json");
  EXPECT_NEAR(at["places"][0]["height_m"].get<double>(), 50, 1e-5);
  EXPECT_EQ(at["places"][1]["coverage"], "outside");
  // What is asked at posts says so.
  EXPECT_THAT(run_tind("volume " + tin + " --height 5 --bounds 1,2,3,4").out, HasSubstr("--posts"));
}

TEST(TinAnalyses, NobodySeesThroughThePyramid) {
  const TempDir dir;
  const std::string tin = pyramid(dir, "p.ply", 100);
  const std::string ends =
      " --posts 10 --places-crs EPSG:32633 --from 500010,5000200 --to 500390,5000200 --from-height "
      "5 --json";
  const json hidden = tind_json("line-of-sight " + tin + ends);
  EXPECT_EQ(hidden["visibility"], "hidden");
  EXPECT_NEAR(hidden["uncertainty_m"].get<double>(), 1.25, 1e-3);
  EXPECT_NEAR(hidden["nearest"]["ground_m"].get<double>(), 100, 0.5);
  EXPECT_EQ(tind_json("line-of-sight " + tin + ends + " --to-height 400")["visibility"], "visible");
  const json seen = tind_json("viewshed " + tin +
                              " --posts 10 --places-crs EPSG:32633 --from 500010,5000200 "
                              "--from-height 10 --to-height 5 --json -o " +
                              dir.file("v.tif"));
  EXPECT_EQ(seen["visible"].get<int>() + seen["hidden"].get<int>() + seen["depends"].get<int>(),
            41 * 41);
  EXPECT_GT(seen["visible"], 300);  // its own side
  EXPECT_GT(seen["hidden"], 300);   // the other one
}

TEST(TinAnalyses, ContoursStatisticsAndReliefTakeOne) {
  const TempDir dir;
  const std::string tin = plane(dir);
  const json lines = tind_json("contours " + tin + kUtm +
                               " --posts 10 --levels 10,20,30 --json -o " + dir.file("c.geojson"));
  EXPECT_EQ(lines["lines"], 3);
  const json bands =
      tind_json("contours " + pyramid(dir, "p.ply", 100) +
                " --posts 100 --levels 50 --as-band --json -o " + dir.file("b.gpkg"));
  EXPECT_NEAR(bands["error_m"].get<double>(), 12.5, 1e-3);
  std::ofstream(dir.file("area.geojson"))
      << R"({"type":"FeatureCollection","crs":{"type":"name","properties":{"name":"EPSG:32633"}},)"
      << R"("features":[{"type":"Feature","properties":{},"geometry":{"type":"Polygon","coordinates":)"
      << "[[[500100,5000050],[500300,5000050],[500300,5000150],[500100,5000150],[500100,5000050]]]}"
         "}]}";
  const json zones = tind_json("statistics " + tin + kUtm + " --posts 10 --polygons " +
                               dir.file("area.geojson") + " --json");
  const json& zone = zones["polygons"][0];
  EXPECT_NEAR(zone["surface_mean_m"].get<double>(), 20, 1e-3);
  EXPECT_NEAR(zone["area_m2"].get<double>(), 200 * 100, 1);
  EXPECT_NEAR(zone["volume_m3"].get<double>(), 200 * 100 * 20, 100);
  const json relief =
      tind_json("relief " + tin + kUtm + " --posts 10 --json -o " + dir.file("r.png"));
  EXPECT_NEAR(relief["low_m"].get<double>(), 0, 1e-6);
  EXPECT_NEAR(relief["high_m"].get<double>(), 40, 1e-4);
}

TEST(TinAnalyses, AMeshIsAsFarFromItsDemAsSimplifySays) {
  const TempDir dir;
  const std::string dem = testdata("rainier.tif"), tin = dir.file("t.ply");
  const json said = tind_json("simplify " + dem +
                              " --bounds -121.80,46.82,-121.70,46.88 --max-error 20 --json "
                              "--progress none -o " +
                              tin);
  // Degrees, and heights above EGM96, as the mesh's file says.
  for (const char* more : {"", " --to-datum ellipsoid --from-datum egm96"}) {
    const json less = tind_json("difference " + tin + " --posts 30 --less " + dem + more +
                                " --json -o " + dir.file("d.tif"));
    EXPECT_GT(less["posts"], 40000);
    const double most = said["max_surface_error_m"].get<double>() + 0.01;
    EXPECT_LE(less["max_m"].get<double>(), most);
    EXPECT_GE(less["min_m"].get<double>(), -most);
    EXPECT_GT(less["rms_m"].get<double>(), 1);
  }
}

/// A LandXML of 100 x 100 units, 10 high. `epsg`: 0 for none.
std::string landxml(const TempDir& dir, const std::string& name, const std::string& units,
                    int epsg = 0) {
  const std::string path = dir.file(name);
  std::ofstream(path) << R"(<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2"><Units>)"
                      << units << "</Units>"
                      << (epsg > 0 ? "<CoordinateSystem epsgCode=\"" + std::to_string(epsg) + "\"/>"
                                   : std::string())
                      << R"(<Surfaces><Surface name="s"><Definition surfType="TIN"><Pnts>)"
                         R"(<P id="1">5000000 500000 10</P><P id="2">5000000 500100 10</P>)"
                         R"(<P id="3">5000100 500100 10</P><P id="4">5000100 500000 10</P></Pnts>)"
                         R"(<Faces><F>1 2 3</F><F>1 3 4</F></Faces></Definition></Surface>)"
                         R"(</Surfaces></LandXML>)";
  return path;
}

TEST(TinAnalyses, FeetAreNotTakenForTheMetresOfACrs) {
  const TempDir dir;
  const std::string feet = landxml(dir, "feet.xml", R"(<Imperial linearUnit="foot"/>)"),
                    metres = landxml(dir, "metres.xml", R"(<Metric linearUnit="meter"/>)");
  const auto area = [](const std::string& asked) {
    return tind_json("volume " + asked + " --height 0 --json")["area_m2"].get<double>();
  };
  EXPECT_NEAR(area(feet), 10000 * .3048 * .3048, 1e-3);
  EXPECT_NEAR(area(feet + " --crs EPSG:2227"), 10000 * .3048 * .3048, 0.1) << "of US feet";
  EXPECT_NEAR(area(metres + " --crs EPSG:32633"), 10000, 1e-3);
  for (const char* posts : {"", " --posts 5"}) {
    const Ran ran = run_tind("volume " + feet + " --height 0 --crs EPSG:32633" + posts);
    EXPECT_EQ(ran.code, 2) << posts << ran.out;
    EXPECT_THAT(ran.out, HasSubstr("feet.xml: its x and y are in units of 0.3048 m"));
  }
  const Ran degrees = run_tind("volume " + feet + " --height 0 --crs EPSG:4326 --posts 0.5");
  EXPECT_THAT(degrees.out, Not(HasSubstr("its x and y are in units")));
}

constexpr int kInUsFeet = 2227, kInMetres = 26943;  // NAD83 / California zone 3

TEST(TinAnalyses, AUnitThatIsNotThatOfTheFilesOwnCrsIsRefused) {
  const TempDir dir;
  const std::string dem = testdata("crater.tif"), line = " --line \"6,7 8,9\"";
  const std::string out = " --progress none -o " + dir.file("o.ply");
  for (const auto& [unit, epsg] : {std::pair(R"(<Imperial linearUnit="USSurveyFoot"/>)", kInMetres),
                                   std::pair(R"(<Metric linearUnit="meter"/>)", kInUsFeet),
                                   std::pair(R"(<Metric linearUnit="millimeter"/>)", kInUsFeet)}) {
    const std::string tin = landxml(dir, "bad.xml", unit, epsg);
    for (const std::string& command :
         {"volume " + tin + " --height 0", "volume " + tin + " --height 0 --posts 5",
          "profile " + tin + line, "elevation " + tin + " --at 6,7",
          "slope " + tin + " --posts 5 -o " + dir.file("o.tif"), "info " + tin,
          "simplify " + tin + " --terrain --ratio 1" + out, "simplify " + tin + " --ratio 1" + out,
          "measure " + tin + " " + dem, "measure " + plane(dir) + " " + tin + " --terrain",
          "compare " + tin + " --methods qem --at 50%", "progressive " + tin + out + ".tpm"}) {
      const Ran ran = run_tind(command);
      EXPECT_EQ(ran.code, 2) << command << "\n" << ran.out;
      EXPECT_THAT(ran.out, HasSubstr("bad.xml: its x and y are in units of")) << command;
      EXPECT_EQ(std::ranges::count(ran.out, '\n'), 1) << command << "\n" << ran.out;
    }
  }
  // Whoever says another CRS says which of the two is wrong.
  const std::string feet =
      landxml(dir, "feet.xml", R"(<Imperial linearUnit="USSurveyFoot"/>)", kInMetres);
  const double us_foot = 1200. / 3937;
  EXPECT_NEAR(tind_json("volume " + feet + " --height 0 --json --crs EPSG:2227")["area_m2"],
              10000 * us_foot * us_foot, 0.01);
}

TEST(TinAnalyses, AUnitIsHeldAgainstTheCrsThatCounts) {
  const TempDir dir;
  const double us_foot = 1200. / 3937;
  for (const char* unit : {"USSurveyFoot", "foot"}) {  // written for each other
    const std::string tin =
        landxml(dir, "feet.xml", std::string("<Imperial linearUnit=\"") + unit + "\"/>", kInUsFeet);
    EXPECT_NEAR(tind_json("volume " + tin + " --height 0 --json")["area_m2"],
                10000 * us_foot * us_foot, 0.01);
    const Ran ran = run_tind("volume " + tin + " --height 0 --crs EPSG:26943");
    EXPECT_EQ(ran.code, 2) << ran.out;
    EXPECT_THAT(ran.out, HasSubstr("feet.xml: its x and y are in units of"));
  }
  const std::string metres = landxml(dir, "m.xml", R"(<Metric linearUnit="meter"/>)", kInMetres);
  EXPECT_NEAR(tind_json("volume " + metres + " --height 0 --json")["area_m2"], 10000, 1e-3);
  // Metres from a point of a CRS in feet, as --frame metric writes them, are metres.
  std::ofstream(dir.file("local.xml"))
      << R"(<LandXML><Units><Metric linearUnit="meter"/></Units><CoordinateSystem desc="origin crs: )"
      << R"(EPSG:2227; origin: 6500000 2000000; metres to crs: 3.28083333 0 0 3.28083333"/>)"
      << R"(<Surfaces><Surface><Definition><Pnts><P id="1">0 0 1</P><P id="2">0 9 1</P>)"
      << R"(<P id="3">9 0 1</P></Pnts><Faces><F>1 2 3</F></Faces></Definition></Surface>)"
      << "</Surfaces></LandXML>";
  EXPECT_NEAR(tind_json("volume " + dir.file("local.xml") + " --height 0 --json")["area_m2"], 40.5,
              1e-3);
}

TEST(TinAnalyses, SayInOneLineWhatCannotBe) {
  const TempDir dir;
  const std::string tin = pyramid(dir, "p.ply", 100);
  const std::string out = " -o " + dir.file("x.tif");
  const auto refused = [&](const std::string& line, const char* why) {
    const Ran ran = run_tind(line);
    EXPECT_NE(ran.code, 0) << line;
    EXPECT_THAT(ran.out, HasSubstr(why)) << line;
    EXPECT_EQ(std::ranges::count(ran.out, '\n'), 1) << line << "\n" << ran.out;
  };
  refused("slope " + tin + out, "say with --posts how many metres apart");
  refused("slope " + testdata("crater.tif") + " --posts 10" + out, "--posts is for a mesh");
  refused("slope " + tin + " --posts 10 --nodata 0" + out, "--nodata is said of rasters");
  refused("slope " + tin + " " + tin + " --posts 10" + out, "one mesh at a time");
  refused("slope " + tin + " --posts 0.001" + out, "too many (at most 400 million)");
  refused("volume " + tin + " --posts 10 --height 0 --tiles " + dir.file("t") + " --level 3",
          "--tiles takes the DEM");
  // Those that work on rasters alone.
  for (const char* command : {"build", "estimate", "refine --bbox 1,2,3,4"})
    refused(std::string(command) + " " + tin +
                (command == std::string("estimate") ? "" : " -o " + dir.file("o.ply")),
            "is a mesh, and a raster is needed here");
  std::ofstream(dir.file("wall.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 1 0 5\nf 1 2 3\nf 2 3 4\n";
  refused("slope " + dir.file("wall.obj") + " --posts 1" + out, "vertical face");
}

}  // namespace
}  // namespace tind
