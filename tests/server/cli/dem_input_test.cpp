// What DEMs may do to the program, and what the program says of them: as its users run it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program.h"
#include "tests/support/support.h"

namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using tind::test::Ran;
using tind::test::run_tind;
using tind::test::testdata;

TEST(DemInput, NoConfigurationFileOfGdalChangesHeights) {
  const tind::test::TempDir dir;
  const std::string dem = dir.file("a.tif");
  fs::copy_file(testdata("bigtujunga_crop.tif"), dem);
  std::ofstream(dem + ".aux.xml")
      << R"(<PAMDataset><PAMRasterBand band="1"><Offset>1000</Offset><Scale>1</Scale></PAMRasterBand></PAMDataset>)";
  fs::create_directory(dir.file(".gdal"));
  const std::string rc = dir.file(".gdal/gdalrc");
  std::ofstream(rc) << "[configoptions]\nGDAL_PAM_ENABLED=YES\nGTIFF_VIRTUAL_MEM_IO=YES\n";
  const Ran plain = run_tind("info " + dem);
  EXPECT_EQ(plain.code, 0) << plain.out;
  EXPECT_THAT(plain.out, HasSubstr("686 .. 1647 m"));
  for (const std::string& before :
       {"HOME=" + dir.path().string(), "GDAL_CONFIG_FILE=" + rc,
        std::string("GDAL_PAM_ENABLED=YES GTIFF_VIRTUAL_MEM_IO=YES GTIFF_USE_MMAP=YES")})
    EXPECT_EQ(run_tind("info " + dem, before).out, plain.out) << before;
}

// ---- headers that promise more than the file holds ----

template <class T>
void put(std::string& out, T value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct TiffHeader {
  std::uint32_t cols, rows, tile;  // tile 0: strips of one row
  std::uint16_t compression = 8, bands = 1;
};

/// A TIFF of 16-bit posts with a header, places for 100 blocks and some bytes.
std::string tiff(const TiffHeader& h) {
  constexpr std::uint32_t kPlaces = 100;
  struct Tag {
    std::uint16_t tag, type;
    std::uint32_t count, value;
  };
  const bool tiled = h.tile > 0;
  const std::uint32_t tags = tiled ? 11 : 10, places = 8 + 2 + 12 * tags + 4;
  std::vector<Tag> all = {{256, 4, 1, h.cols},
                          {257, 4, 1, h.rows},
                          {258, 3, 1, 16},
                          {259, 3, 1, h.compression},
                          {262, 3, 1, 1}};
  if (!tiled) all.push_back({273, 4, kPlaces, places});
  all.push_back({277, 3, 1, h.bands});
  if (!tiled) all.insert(all.end(), {{278, 4, 1, 1}, {279, 4, kPlaces, places + 4 * kPlaces}});
  if (tiled)
    all.insert(all.end(), {{322, 3, 1, h.tile},
                           {323, 3, 1, h.tile},
                           {324, 4, kPlaces, places},
                           {325, 4, kPlaces, places + 4 * kPlaces}});
  all.push_back({339, 3, 1, 2});
  std::string out("II\x2a\0\x08\0\0\0", 8);
  put(out, std::uint16_t(all.size()));
  for (const Tag& t : all) {
    put(out, t.tag), put(out, t.type), put(out, t.count);
    put(out, t.value);  // a short stands in the first half
  }
  put(out, std::uint32_t(0));
  for (std::uint32_t i = 0; i < kPlaces; ++i) put(out, places + 8 * kPlaces + i);
  for (std::uint32_t i = 0; i < kPlaces; ++i) put(out, std::uint32_t(30));
  return out + "\x78\x9c" + std::string(3000, '\0');
}

TEST(DemInput, AHeaderThatPromisesMoreThanTheFileHoldsTakesNoMemory) {
  const tind::test::TempDir dir;
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    const std::string file = dir.file(name);
    std::ofstream(file, std::ios::binary) << bytes;
    for (const std::string& command :
         {"info " + file, "simplify " + file + " --ratio 0.5 -o " + dir.file("m.ply")}) {
      const Ran ran = run_tind(command, tind::test::kSanitized ? "" : "ulimit -v 700000;");
      EXPECT_THAT(ran.code, testing::AnyOf(2, 65)) << command << "\n" << ran.out;
      EXPECT_THAT(ran.out, HasSubstr("tind: ")) << command;
      EXPECT_THAT(ran.out, Not(HasSubstr("bad_alloc"))) << command;
    }
  };
  refused("blocks.tif", tiff({740000, 740000, 16}));
  refused("strips.tif", tiff({16, 1000000000, 0}));
  refused("largest.tif", tiff({1u << 30, 1u << 30, 16}));
  refused("raw.tif", tiff({740000, 740000, 16, 1}));
  refused("bands.tif", tiff({1000, 1000, 16, 1, 60000}));
  const std::string header = "xllcorner 0\nyllcorner 0\ncellsize 0.001\n1 2 3\n";
  refused("wide.asc", "ncols 9999999\nnrows 2\n" + header);
  refused("high.asc", "ncols 2\nnrows 9999999\n" + header);
}

// ---- what is said of nodata and of the datum ----

/// 60 x 60 posts of a slope in degrees, one of them -9999.
std::string slope_with_a_hole(const tind::test::TempDir& dir) {
  const std::string file = dir.file("slope.asc");
  std::ofstream out(file);
  out << "ncols 60\nnrows 60\nxllcorner 7\nyllcorner 46\ncellsize 0.001\n";
  for (int r = 0; r < 60; ++r)
    for (int c = 0; c < 60; ++c) out << (r == 30 && c == 20 ? -9999 : r + 2 * c) << ' ';
  std::ofstream(dir.file("slope.prj")) << "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS "
                                          "84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
                                          "UNIT[\"degree\",0.0174532925199433]]";
  return file;
}

TEST(DemInput, EveryCommandWarnsOfUndeclaredNodataAndTakesIt) {
  const tind::test::TempDir dir;
  const std::string dem = slope_with_a_hole(dir);
  for (const std::string& command :
       {"info " + dem, "simplify " + dem + " --ratio 0.5 -o " + dir.file("m.ply"),
        "build " + dem + " --force -o " + dir.file("tiles"),
        "refine " + dem + " --bbox 7.01,46.01,7.02,46.02 --inside 1 --outside 9 -o " +
            dir.file("r.ply"),
        "compare " + dem + " --methods qem --at 50%"}) {
    const Ran warned = run_tind(command), told = run_tind(command + " --nodata -9999");
    EXPECT_EQ(warned.code, 0) << warned.out;
    EXPECT_THAT(warned.out, HasSubstr("1 post is -9999")) << command;
    EXPECT_THAT(warned.out, HasSubstr("--nodata -9999")) << command;
    EXPECT_EQ(told.code, 0) << told.out;
    EXPECT_THAT(told.out, Not(HasSubstr("--nodata"))) << command;
  }
  EXPECT_THAT(run_tind("info " + dem + " --nodata -9999").out, HasSubstr("voids      1 "));
  EXPECT_EQ(run_tind("info " + dem + " --nodata nothing").code, 2);
}

TEST(DemInput, AnUnknownDatumIsNotConvertedInSilence) {
  const tind::test::TempDir dir;
  const std::string dem = slope_with_a_hole(dir) + " --nodata -9999", mesh = dir.file("m.ply");
  const Ran refused = run_tind("simplify " + dem + " --ratio 0.5 --to-datum ellipsoid -o " + mesh);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.out, HasSubstr("--from-datum"));
  EXPECT_FALSE(fs::exists(mesh));
  EXPECT_EQ(run_tind("simplify " + dem +
                     " --ratio 0.5 --to-datum ellipsoid --from-datum egm96 -o " + mesh)
                .code,
            0);
  EXPECT_EQ(run_tind("build " + dem + " --to-datum ellipsoid -o " + dir.file("t")).code, 2);
}

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(DemInput, EveryOutputSaysTheDatum) {
  const tind::test::TempDir dir;
  const std::string dem = slope_with_a_hole(dir) + " --nodata -9999";
  const std::pair<const char*, const char*> kSaid[] = {{"unknown", "unknown"},
                                                       {"egm96", "ellipsoid"}};
  for (const auto& [from, above] : kSaid) {
    const std::string said = dem + " --from-datum " + from, tiles = dir.file(from);
    const Ran built = run_tind("build " + said + " -o " + tiles);
    EXPECT_EQ(built.code, 0) << built.out;
    EXPECT_THAT(built.answer, HasSubstr(std::string("vertical datum: ") + above));
    EXPECT_EQ(nlohmann::json::parse(text_of(tiles + "/layer.json"))["datum"], above);
    EXPECT_THAT(run_tind("info " + tiles).out, HasSubstr(std::string("datum      ") + above));
  }
  for (const char* from : {"unknown", "egm96"}) {
    const std::string mesh = dir.file(std::string(from) + ".ply");
    EXPECT_EQ(
        run_tind("simplify " + dem + " --from-datum " + from + " --ratio 0.5 -o " + mesh).code, 0);
    EXPECT_THAT(text_of(mesh), HasSubstr(std::string("comment vertical datum: ") + from + "\n"));
  }
}

TEST(DemInput, EveryReportRepeatsTheStatedAccuracyAndNoTileChanges) {
  const tind::test::TempDir dir;
  const std::string plain = slope_with_a_hole(dir) + " --nodata -9999 --from-datum egm96",
                    dem = plain + " --accuracy LE90=4", tiles = dir.file("tiles"),
                    mesh = dir.file("m.ply");
  const auto one = nlohmann::json::parse(R"({"kind":"le90","m":4})");
  const auto list = nlohmann::json::array({one});
  const auto json_of = [](const std::string& command) {
    const Ran ran = run_tind(command + " --json");
    EXPECT_EQ(ran.code, 0) << command << ran.out;
    return nlohmann::json::parse(ran.answer, nullptr, false);
  };
  EXPECT_EQ(json_of("build " + dem + " -o " + tiles)["accuracy"], list);
  EXPECT_EQ(nlohmann::json::parse(text_of(tiles + "/layer.json"))["accuracy"], list);
  EXPECT_EQ(json_of("info " + tiles)["accuracy"], list);
  EXPECT_THAT(run_tind("info " + tiles).out, HasSubstr("accuracy   4 m (le90)"));
  EXPECT_EQ(json_of("explain " + tiles + " 0/1/0 --source " + dem)["accuracy"], list);
  EXPECT_EQ(json_of("check " + tiles + " --source " + dem)["accuracy"], list);
  EXPECT_EQ(json_of("simplify " + dem + " --ratio 0.5 -o " + mesh)["accuracy"], one);
  EXPECT_EQ(json_of("measure " + mesh + " " + dem)["accuracy"], one);
  EXPECT_EQ(json_of("progressive " + dem + " -o " + dir.file("m.tpm"))["accuracy"], one);
  EXPECT_THAT(run_tind("simplify " + dem + " --ratio 0.5 -o " + mesh).out,
              HasSubstr("as stated: 4 m (le90)"));
  EXPECT_FALSE(json_of("simplify " + plain + " --ratio 0.5 -o " + mesh).contains("accuracy"));
  // Another word of it: not one tile is made again.
  const auto again = json_of("build " + plain + " --accuracy rmse=1 -o " + tiles);
  EXPECT_EQ(again["built"], 0);
  EXPECT_EQ(again["accuracy"][0]["kind"], "rmse");
  EXPECT_EQ(nlohmann::json::parse(text_of(tiles + "/layer.json"))["accuracy"][0]["m"], 1);
}

TEST(DemInput, WordsCountInAnyCase) {
  const tind::test::TempDir dir;
  const std::string dem = slope_with_a_hole(dir) + " --nodata ",
                    to = " --ratio 0.5 -o " + dir.file("m.ply");
  for (const char* said : {"NONE --method QEM", "-9999 --encoding Number",
                           "none --from-datum EGM96", "None --effort FAST"}) {
    const Ran ran = run_tind("simplify " + dem + said + to);
    EXPECT_EQ(ran.code, 0) << said << ran.out;
  }
  EXPECT_THAT(run_tind("simplify " + dem + "none --method QEM" + to).answer, HasSubstr("qem: "));
  EXPECT_EQ(run_tind("simplify " + dem + "nothing" + to).code, 2);
}

TEST(DemInput, AMethodWithOptionsInItsNameIsToldHowTheyAreGiven) {
  const Ran ran = run_tind("build none.tif --method 'edge-cost alpha=0.5' -o t");
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.out, HasSubstr("--method edge-cost --alpha 0.5"));
}

TEST(DemInput, AFormatThatIsOnlyWrittenIsNamed) {
  const tind::test::TempDir dir;
  const std::string glb = dir.file("m.glb");
  ASSERT_EQ(
      run_tind("simplify " + tind::test::testdata("desert.asc") + " --ratio 0.5 -o " + glb).code,
      0);
  for (const std::string& command : {"info " + glb, "simplify " + glb + " --ratio 0.5 -o a.ply"}) {
    const Ran ran = run_tind(command);
    EXPECT_EQ(ran.code, 65) << ran.out;
    EXPECT_THAT(ran.out, HasSubstr("but reads neither them nor rasters"));
  }
}

TEST(DemInput, AFileThatIsNamedAgainCountsOnce) {
  const tind::test::TempDir dir;
  const std::string dem = tind::test::testdata("desert.asc");
  std::ofstream(dir.file("l.txt")) << dem << "\n" << dem << "\n" << dem << "\n";
  const auto json = [](const Ran& ran) {
    return nlohmann::json::parse(ran.answer, nullptr, false);
  };
  const Ran list = run_tind("info @" + dir.file("l.txt") + " --json");
  EXPECT_EQ(list.code, 0) << list.out;
  EXPECT_EQ(json(list)["files"].size(), 1u) << list.answer;
  EXPECT_THAT(run_tind("estimate @" + dir.file("l.txt")).out, HasSubstr("counts once"));
}

// ---- messages ----

TEST(DemInput, MessagesDoNotSpeakToTheTerminal) {
  for (const std::string& command :
       {std::string("info"), std::string("simplify --ratio 0.5 -o m.ply"), std::string("serve")}) {
    const Ran ran = run_tind(command + " \"$(printf 'a\\033[31m\\302\\233b\\007.tif')\"");
    EXPECT_NE(ran.code, 0);
    EXPECT_THAT(ran.out, HasSubstr("a\\x1b[31m\\xc2\\x9bb\\x07.tif")) << command;
    EXPECT_EQ(ran.out.find('\x1b'), std::string::npos) << command;
  }
  const Ran wrong = run_tind("info \"$(printf -- '--\\033[31m')\" x");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_EQ(wrong.out.find('\x1b'), std::string::npos) << wrong.out;
}

TEST(DemInput, ServeNamesEveryDatasetThatCannotBeServed) {
  const tind::test::TempDir dir;
  std::ofstream(dir.file("noise.tif")) << "noise";
  std::filesystem::create_symlink("loop.tif", dir.file("loop.tif"));
  const Ran ran =
      run_tind("serve " + testdata("rainier.tif") + " " + dir.file("noise.tif") + " " +
               dir.file("none.tif") + " " + dir.file("loop.tif") + " --listen 127.0.0.1:0");
  EXPECT_EQ(ran.code, 65);
  EXPECT_THAT(ran.out, HasSubstr(dir.file("noise.tif") + ": not a raster"));
  EXPECT_THAT(ran.out, HasSubstr(dir.file("none.tif") + ": no such file"));
  EXPECT_THAT(ran.out, HasSubstr(dir.file("loop.tif") + ": Too many levels of symbolic links"));
  EXPECT_THAT(ran.out, HasSubstr("3 datasets cannot be served"));
}

TEST(Serve, ASwitchIsWhatItsValueSays) {
  const std::string serve = "serve " + testdata("rainier.tif") + " --print-config ";
  EXPECT_THAT(run_tind(serve + "--allow-vrt", "TIND_ALLOW_VRT=false").out,
              HasSubstr("allow_vrt = true"));
  EXPECT_THAT(run_tind(serve + "--allow-vrt=false", "TIND_ALLOW_VRT=true").out,
              HasSubstr("allow_vrt = false"));
  EXPECT_THAT(run_tind(serve).out, HasSubstr("allow_vrt = false"));
  const Ran other = run_tind(serve + "--allow-vrt=garbage");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.out, HasSubstr("allow-vrt"));
  EXPECT_THAT(other.out, Not(HasSubstr("internal")));
}

TEST(Serve, EndsWhereNobodyCouldLearnItsAddress) {
  const Ran full =
      run_tind("serve " + testdata("rainier.tif") + " --listen 127.0.0.1:0 >/dev/full");
  EXPECT_EQ(full.code, 74);
  EXPECT_THAT(full.out, HasSubstr("No space left"));
}

TEST(DemInput, FlagsForDemsBesideNothingButTilesAreRefused) {
  const tind::test::TempDir dir;
  const std::string dem = testdata("desert.asc"), tiles = dir.file("tiles");
  ASSERT_EQ(run_tind("build " + dem + " -o " + tiles + " --levels 0-3").code, 0);
  const std::string flags = " --max-error 3 --from-datum egm96 --check-config";
  const Ran alone = run_tind("serve " + tiles + flags);
  EXPECT_EQ(alone.code, 2);
  EXPECT_THAT(alone.out, HasSubstr("leave out what is for a DEM: --from-datum, --max-error"));
  EXPECT_EQ(run_tind("serve " + tiles + " " + dem + flags).code, 0);
  EXPECT_EQ(run_tind("serve " + tiles + " --cache-mb 9 --check-config").code, 0);
}

/// Every second post of every second row is valid, so no two neighbours are.
void write_apart(const std::string& path) {
  std::ofstream file(path);
  file << "ncols 9\nnrows 9\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n";
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c) file << (r % 2 || c % 2 ? -9999 : r * c) << (c < 8 ? ' ' : '\n');
}

TEST(DemInput, PostsWithoutNeighboursAreNotCalledVoid) {
  const tind::test::TempDir dir;
  const std::string dem = dir.file("apart.asc");
  write_apart(dem);
  for (const std::string& line :
       {"progressive " + dem + " -o " + dir.file("a.tpm"),
        "simplify " + dem + " --method qem --voids keep --ratio 1 -o " + dir.file("a.ply")}) {
    const Ran ran = run_tind(line);
    EXPECT_EQ(ran.code, 65) << line;
    EXPECT_THAT(ran.out, HasSubstr(dem + ": no cell has three valid corners"));
    EXPECT_THAT(ran.out, HasSubstr("(25)"));
    EXPECT_THAT(ran.out, HasSubstr("--voids cover"));
  }
  for (const std::string method : {"bounded", "qem"}) {
    const Ran covers =
        run_tind("simplify " + dem + " --method " + method + " --ratio 1 -o " + dir.file("a.ply"));
    EXPECT_EQ(covers.code, 0) << covers.out;
  }
}

TEST(DemInput, OnePostIsAFaultOfTheFileAndNamesIt) {
  const tind::test::TempDir dir;
  std::ofstream(dir.file("one.asc"))
      << "ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 10\n5\n";
  const Ran ran =
      run_tind("simplify " + dir.file("one.asc") + " --ratio 1 -o " + dir.file("a.ply"));
  EXPECT_EQ(ran.code, 65);
  EXPECT_THAT(ran.out, HasSubstr(dir.file("one.asc") + ": a grid of 1 x 1 posts"));
}

void write_wgs84_prj(const std::string& path) {
  std::ofstream(path)
      << "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
         "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";
}

TEST(Serve, AsRootOnlyWhenThatIsMeant) {
  if (::geteuid() != 0) GTEST_SKIP() << "not root";
  const std::string flags = " --listen 127.0.0.1:0 --viewer /nowhere";  // which ends a start
  const Ran refused = run_tind("serve " + testdata("rainier.tif") + flags, "TIND_AS_ROOT=false");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.out, HasSubstr("will not serve as root"));
  const Ran meant =
      run_tind("serve " + testdata("rainier.tif") + flags + " --as-root", "TIND_AS_ROOT=false");
  EXPECT_THAT(meant.out, HasSubstr("/nowhere"));
  const Ran checked =
      run_tind("serve " + testdata("rainier.tif") + " --check-config", "TIND_AS_ROOT=false");
  EXPECT_EQ(checked.code, 0) << checked.out;
}

TEST(DemInput, ACrsThatIsThereWithoutItsGridIsAnotherFiles) {
  const tind::test::TempDir dir;
  const std::string line = "slope " + testdata("rainier.tif") + " -o " + dir.file("roads.asc");
  std::ofstream(dir.file("roads.prj")) << "of roads.shp";
  const Ran refused = run_tind(line);
  EXPECT_EQ(refused.code, 2) << refused.out;
  EXPECT_THAT(refused.out, HasSubstr("roads.prj"));
  std::string kept;
  std::getline(std::ifstream(dir.file("roads.prj")), kept);
  EXPECT_EQ(kept, "of roads.shp");
  std::filesystem::remove(dir.file("roads.prj"));
  EXPECT_EQ(run_tind(line).code, 0);
  EXPECT_EQ(run_tind(line).code, 0) << "its own is replaced with it";
}

TEST(DemInput, WhatIsSaidOfAnOptionIsOneLine) {
  const Ran ran = run_tind("elevation " + testdata("rainier.tif") +
                           " --at -121.7,46.8 --to-datum $'no\ntind: done.tif'");
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.out, HasSubstr("\\x0atind: done.tif"));
}

TEST(DemInput, BuildWarnsOfPostsThatAreTooFineForTiles) {
  const tind::test::TempDir dir;
  const std::string dem = dir.file("fine.asc");
  write_wgs84_prj(dir.file("fine.prj"));
  for (const auto& [step, warned] :
       {std::pair("0.00000005", true), std::pair("0.0000001", true),  // 0.8 x 1.1 cm
        std::pair("0.0000005", false)}) {
    std::ofstream(dem) << "ncols 3\nnrows 2\nxllcorner 7.6\nyllcorner 46.1\ncellsize " << step
                       << "\n1 1 1\n1 1 1\n";
    const Ran ran = run_tind("build " + dem + " -o " + dir.file(std::string("tiles") + step));
    EXPECT_EQ(ran.code, 0) << ran.out;
    EXPECT_EQ(ran.out.find("less than 1 cm apart") != std::string::npos, warned) << ran.out;
  }
}

TEST(DemInput, BuildSaysWhenAnErrorAskedForChangesNothing) {
  const tind::test::TempDir dir;
  const std::string line = "build " + testdata("rainier.tif") + " --deepest 6 -o ";
  const Ran large = run_tind(line + dir.file("a") + " --max-error 100000");
  EXPECT_EQ(large.code, 0) << large.out;
  EXPECT_THAT(large.out, HasSubstr("100000 m, changes nothing: level 6 keeps 1204.18 m"));
  const Ran small = run_tind(line + dir.file("b") + " --max-error 1000");
  EXPECT_EQ(small.out.find("changes nothing"), std::string::npos) << small.out;
}

TEST(DemInput, SaysWhatWasMeantByAnInputThatIsNone) {
  EXPECT_THAT(run_tind("simplify /dev/zero --ratio 1 -o a.ply").out, HasSubstr("is a device"));
  for (const char* how : {" --check-config", " --listen 127.0.0.1:0"}) {
    const Ran joined = run_tind(std::string("serve a.tif,b.tif") + how);
    EXPECT_EQ(joined.code, 69);
    EXPECT_THAT(joined.out, HasSubstr("NAME=a.tif,b.tif"));
  }
  const Ran method = run_tind("compare none.tif --methods qem,foo --at 10%");
  EXPECT_EQ(method.code, 2);
  EXPECT_THAT(method.out, HasSubstr("there is no method 'foo'"));
}

}  // namespace
