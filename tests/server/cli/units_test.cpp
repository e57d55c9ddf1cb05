// A DEM in feet beside the same one in metres: what comes out of every format is in metres, and so
// is what is said of its errors. A DEM in feet is known a hair less exactly (its numbers are
// rounded once more), so errors may differ by that, and fine meshes with them.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "terrain/base/file_io.h"
#include "terrain/geo/ellipsoid.h"
#include "tests/support/drawn_glb.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

using test::run_tind;
using test::tind_json;

constexpr int kPosts = 41;          // a side
constexpr double kRounding = 2e-3;  // m; of heights in feet, twice: of a height and of an error

struct Unit {
  const char* name;  // as GDAL has it
  double metres;
};
void PrintTo(const Unit& unit, std::ostream* out) { *out << unit.name; }

class Feet : public ::testing::TestWithParam<Unit> {
 protected:
  const test::TempDir dir_;
  double low_m_ = HUGE_VAL, high_m_ = -HUGE_VAL;

  void SetUp() override {
    write_grid("metres", GetParam().metres);
    write_grid("numbers", 1);
    std::ofstream(dir_.file("feet.vrt"))
        << "<VRTDataset rasterXSize=\"" << kPosts << "\" rasterYSize=\"" << kPosts
        << "\"><SRS>EPSG:4326</SRS><GeoTransform>10, 0.001, 0, 45.041, 0, -0.001</GeoTransform>"
        << "<VRTRasterBand dataType=\"Float32\" band=\"1\"><UnitType>" << GetParam().name
        << "</UnitType><SimpleSource><SourceFilename relativeToVRT=\"1\">numbers.asc"
        << "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>"
        << "</VRTDataset>";
  }

  /// Whole feet, so that the numbers in metres are the same to the last bit of a float.
  void write_grid(const std::string& name, double unit) {
    std::ofstream out(dir_.file(name + ".asc"));
    out << "ncols " << kPosts << "\nnrows " << kPosts
        << "\nxllcorner 10\nyllcorner 45\ncellsize 0.001\n"
        << std::fixed << std::setprecision(unit == 1 ? 0 : 9);
    for (int r = 0; r < kPosts; ++r)
      for (int c = 0; c < kPosts; ++c) {
        const double feet =
            std::round(3000 + 900 * std::sin(c / 9.) * std::cos(r / 11.)) + (c * 7 + r * 13) % 23;
        out << feet * unit << " \n"[c == kPosts - 1];
        if (unit == 1) continue;
        low_m_ = std::min(low_m_, feet * unit), high_m_ = std::max(high_m_, feet * unit);
      }
    std::ofstream(dir_.file(name + ".prj"))
        << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
        << R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  }

  std::string metres() const { return dir_.file("metres.asc") + " --from-datum ellipsoid "; }
  std::string feet() const {
    return dir_.file("feet.vrt") + " --allow-vrt --from-datum ellipsoid ";
  }

  /// Runs a line for either DEM; where its output is.
  std::string out_of(const std::string& command, const std::string& dem, const std::string& name,
                     const std::string& options) {
    const std::string out = dir_.file(name);
    const auto ran = run_tind(command + " " + dem + options + " -o " + out);
    EXPECT_EQ(ran.code, 0) << ran.out;
    return out;
  }

  /// The files of a folder with that ending, by their names; of a file itself.
  static std::map<std::string, std::string> files(const std::string& at, const std::string& end) {
    std::map<std::string, std::string> all;
    if (fs::is_regular_file(at)) return {{"", *read_whole_file(at)}};
    for (const auto& entry : fs::recursive_directory_iterator(at))
      if (entry.is_regular_file() && entry.path().string().ends_with(end))
        all[entry.path().lexically_relative(at)] = *read_whole_file(entry.path());
    return all;
  }

  /// Both DEMs give the same bytes.
  void expect_alike(const std::string& command, const std::string& options, const std::string& name,
                    const std::string& ending = "") {
    const auto a = files(out_of(command, metres(), "m_" + name, options), ending);
    const auto b = files(out_of(command, feet(), "f_" + name, options), ending);
    EXPECT_FALSE(a.empty()) << name;
    EXPECT_TRUE(a == b) << command << options << ": " << a.size() << " and " << b.size()
                        << " files are not the same";
  }
};

TEST_P(Feet, AreMetresInTilesAndTheirErrors) {
  const std::string tiles =
      out_of("build", feet(), "tiles", "--format 3dtiles --progress none --max-error 2");
  const auto check = tind_json("check " + tiles + " --json --source " + metres());
  EXPECT_EQ(check["violations"], 0) << check;
  EXPECT_GT(check["levels"].size(), 5u) << check;
  int looked_at = 0;
  for (const auto& [name, bytes] : files(tiles, ".glb")) {
    const auto glb = test::read_glb({bytes.begin(), bytes.end()});
    // Those above the deepest levels have errors as large as the mountains, and walls.
    if (name.find("/12/") == name.npos) continue;
    for (const Vec3& v : glb.parts.front().vertices) {
      const double height = wgs84::from_ecef(v).height_m;
      EXPECT_LT(height, high_m_ + 2.1) << name;
      looked_at += height > low_m_ - 2.1;
    }
  }
  EXPECT_GT(looked_at, 100);
}

TEST_P(Feet, AreMetresInImages) {
  for (const std::string format : {"rgb", "terrarium", "hillshade", "slope"})
    expect_alike("build", "--progress none --format " + format, format, ".png");
}

TEST_P(Feet, AreMetresInHeightmaps) {
  expect_alike("export", "--format unreal", "unreal.r16");
  expect_alike("export", "--format unity", "unity.raw");
  expect_alike("export", "--format cdb", "cdb", ".tif");
}

TEST_P(Feet, AreMetresInScenery) {
  expect_alike("build", "--progress none --format flightgear", "scenery", ".btg.gz");
  const auto stated = [&](const std::string& folder) {
    const std::string stg = files(dir_.file(folder), ".stg").begin()->second;
    return std::stod(stg.substr(stg.find("error: ") + 7));
  };
  EXPECT_GT(stated("m_scenery"), 0.1);
  EXPECT_NEAR(stated("f_scenery"), stated("m_scenery"), kRounding);
}

TEST_P(Feet, AreMetresInMeshesAndTheirErrors) {
  for (const std::string format : {"ply", "obj", "stl", "glb", "2dm", "vtu"}) {
    const std::string mesh = dir_.file("mesh." + format);
    const auto made = tind_json("simplify " + feet() +
                                "--json --frame metric --max-error 3 --method greedy -o " + mesh);
    EXPECT_NEAR(made["max_error_m"].get<double>(), 3, 1) << format;
    if (format == "glb" || format == "vtu") continue;  // which are written only
    const auto info = tind_json("info " + mesh + " --json");
    EXPECT_NEAR(info["high"][2].get<double>(), high_m_, 3 + kRounding) << info;
  }
  const std::string mesh = dir_.file("mesh.ply");
  const auto made = tind_json("simplify " + feet() + "--json --max-error 3 -o " + mesh);
  const auto truth = tind_json("measure " + mesh + " " + metres() + "--json");
  EXPECT_LE(truth["max_error_m"].get<double>(), 3 + kRounding);
  EXPECT_NEAR(truth["max_error_m"].get<double>(), made["max_error_m"].get<double>(), kRounding);
}

TEST_P(Feet, AreMetresInEveryLevelOfAStream) {
  const std::string stream = out_of("progressive", feet(), "all.tpm", "");
  const std::string mesh = out_of("extract", stream, "level.ply", " --max-error 20");
  EXPECT_LE(tind_json("measure " + mesh + " " + metres() + "--json")["max_error_m"].get<double>(),
            20 + kRounding);
}

TEST_P(Feet, AreFeetOnlyWhereTheyAreAskedFor) {
  const std::string mesh = dir_.file("mesh.ply");
  const auto made =
      tind_json("simplify " + feet() + "--json --units source --max-error 3 -o " + mesh);
  EXPECT_LE(made["max_error_m"].get<double>(), 3 + kRounding);  // all the same
  const auto info = tind_json("info " + mesh + " --json");
  EXPECT_NEAR(info["high"][2].get<double>() * GetParam().metres, high_m_, 3 + kRounding) << info;
}

INSTANTIATE_TEST_SUITE_P(Units, Feet,
                         ::testing::Values(Unit{"ft", 0.3048}, Unit{"foot", 0.3048},
                                           Unit{"US survey foot", 1200. / 3937}));

}  // namespace
}  // namespace tind
