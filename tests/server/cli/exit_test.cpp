// One failure has one exit code, whatever the command.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "terrain/base/file_io.h"
#include "tests/support/program.h"

namespace tind {
namespace {

using test::run_tind;

class ExitCode : public ::testing::Test {
 protected:
  const test::TempDir folder_;
  const std::string dem_ = test::testdata("desert.asc");
  const std::string mesh_ = folder_.file("mesh.obj");

  void SetUp() override {
    std::ofstream(mesh_) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 2 4 3\n";
  }
  void expect(int code, const std::vector<std::string>& commands) const {
    for (const std::string& command : commands) {
      const auto ran = run_tind(command);
      EXPECT_EQ(ran.code, code) << command << '\n' << ran.out;
    }
  }
};

TEST_F(ExitCode, OfAnOutputThatCannotBeCreated) {
  std::ofstream(folder_.file("file")) << "in the way";
  const std::string in = folder_.file("file/x");
  expect(73,
         {"simplify " + dem_ + " --ratio 0.5 -o " + in + ".ply",
          "simplify " + mesh_ + " --ratio 0.5 -o " + in + ".ply",
          "progressive " + dem_ + " -o " + in + ".tpm",
          "between " + mesh_ + " " + mesh_ + " -o " + in + ".tpm",
          "compare " + dem_ + " --at 10% --csv " + in, "build " + dem_ + " --levels 0-1 -o " + in,
          "build " + dem_ + " --levels 0-1 --format hillshade -o " + in,
          "build " + dem_ + " --format flightgear -o " + in,
          "export " + dem_ + " --format unreal --size 127 -o " + in + ".r16",
          "export " + dem_ + " --format cdb --lod -9 -o " + in});
}

TEST_F(ExitCode, OfAnOutputThatCannotBeWrittenToItsEnd) {
  const std::string full = folder_.file("full");
  for (const char* ending : {".ply", ".tpm", ".r16", ".csv", ".json", ".tif"})
    std::filesystem::create_symlink("/dev/full", full + ending);
  expect(74, {"simplify " + dem_ + " --ratio 0.5 -o " + full + ".ply",
              "simplify " + mesh_ + " --ratio 0.5 -o " + full + ".ply",
              "simplify " + dem_ + " --ratio 0.5 -o " + folder_.file("a.ply") + " --report " +
                  full + ".json",
              "simplify " + dem_ + " --ratio 0.5 -o " + folder_.file("a.ply") + " --raster " +
                  full + ".tif",
              "progressive " + dem_ + " -o " + full + ".tpm",
              "progressive " + mesh_ + " --base 1 -o " + full + ".tpm",
              "between " + mesh_ + " " + mesh_ + " -o " + full + ".tpm",
              "compare " + dem_ + " --at 50% --methods qem --csv " + full + ".csv",
              "export " + dem_ + " --format unreal --size 127 -o " + full + ".r16"});
}

TEST_F(ExitCode, OfAnInputThatIsNotThere) {
  const std::string none = folder_.file("none"), out = " -o " + folder_.file("out");
  expect(69, {"simplify " + none + ".tif --ratio 0.5" + out + ".ply",
              "copy " + none + " " + folder_.file("out.pmtiles"), "verify " + none,
              "simplify " + none + ".ply --ratio 0.5" + out + ".ply",
              "progressive " + none + ".obj" + out + ".tpm",
              "between " + none + ".ply " + mesh_ + out + ".tpm",
              "extract " + none + ".tpm" + out + ".ply", "info " + none + ".stl",
              "info " + none + ".tpm", "measure " + none + ".ply " + dem_,
              "plan " + dem_ + " --trajectory " + none + ".csv", "build " + none + ".tif" + out});
}

TEST_F(ExitCode, OfAMachineWithoutTheDatabaseOfCoordinateSystems) {
  const std::string without = "PROJ_DATA=" + folder_.path().string();
  for (const char* file : {"desert.asc", "rainier.tif"}) {
    const auto ran = run_tind("info " + test::testdata(file), without);
    EXPECT_EQ(ran.code, 74) << ran.out;
    EXPECT_NE(ran.out.find("PROJ_DATA"), std::string::npos) << ran.out;
  }
}

/// In feet: who cannot look that up would take them for metres.
TEST_F(ExitCode, OfAMeshWhoseSystemCannotBeLookedUp) {
  const std::string mesh = folder_.file("feet.ply");
  std::ofstream(mesh) << "ply\nformat ascii 1.0\ncomment crs: EPSG:2227\nelement vertex 4\n"
                         "property double x\nproperty double y\nproperty double z\n"
                         "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
                         "6000000 2000000 1\n6000900 2000000 2\n6000900 2000900 3\n"
                         "6000000 2000900 4\n3 0 1 2\n3 0 2 3\n";
  for (const std::string& asked :
       {"measure " + mesh + " " + mesh + " --terrain", "info " + mesh,
        "simplify " + mesh + " --terrain --max-error 5 -o " + folder_.file("less.ply"),
        "slope " + mesh + " --posts 100 -o " + folder_.file("slope.tif")}) {
    EXPECT_EQ(run_tind(asked, "PROJ_DATA=" + folder_.path().string()).code, 74) << asked;
    EXPECT_EQ(run_tind(asked).code, 0) << asked;
  }
}

/// A link to itself is what nobody can look at, root neither: what it would be is not known, and it
/// is not taken for absent.
TEST_F(ExitCode, OfWhatCannotBeLookedAt) {
  const auto loop = [&](const std::string& name) {
    const std::string path = folder_.file(name);
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::filesystem::create_symlink(std::filesystem::path(path).filename(), path);
    return path;
  };
  loop("geoids/egm84-15.pgm");  // a coarser grid, or none, has other heights
  const std::string geoids = "GEOGRAPHICLIB_GEOID_PATH=" + folder_.file("geoids");
  EXPECT_EQ(run_tind("info " + dem_ + " --from-datum egm84 --to-datum ellipsoid", geoids).code, 74);

  loop("heights.prj");  // may be a stranger's
  EXPECT_EQ(run_tind("simplify " + dem_ + " --ratio 0.5 --raster " + folder_.file("heights.asc") +
                     " -o " + folder_.file("mesh.ply"))
                .code,
            74);
  EXPECT_FALSE(std::filesystem::exists(folder_.file("heights.asc")));

  const std::string tiles = folder_.file("some"), store = folder_.file("some.mbtiles");
  ASSERT_EQ(run_tind("build " + dem_ + " --levels 0-2 -o " + tiles).code, 0);
  ASSERT_EQ(run_tind("copy " + tiles + " " + store).code, 0);
  expect(0, {"check " + store});
  loop("some.mbtiles-wal");  // what a writer has not written into the database yet
  EXPECT_EQ(run_tind("check " + store).code, 74);
}

/// PROJ looks into homes of users, too, and may be let into none: it goes on with its own folders.
TEST_F(ExitCode, IsZeroWhereAFolderThatIsSearchedIsClosed) {
  const std::string home = folder_.file("home");
  std::filesystem::create_symlink("home", home);
  const auto ran =
      run_tind("info " + test::testdata("bigtujunga_crop.tif"), "XDG_DATA_HOME=" + home);
  EXPECT_EQ(ran.code, 0) << ran.out;
}

TEST_F(ExitCode, OfMoreMemoryThanNumbersHave) {
  for (const char* much : {"18446744073709551616", "99999999999999999999999", "20000000000G"}) {
    const auto ran = run_tind("build " + dem_ + " --memory " + much + " -o " + folder_.file("t"));
    EXPECT_EQ(ran.code, 2) << much << '\n' << ran.out;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.file("t")));
}

TEST_F(ExitCode, OfLevelsThatATileSetDoesNotHave) {
  const std::string tiles = folder_.file("tiles");
  ASSERT_EQ(run_tind("build " + dem_ + " --levels 0-2 -o " + tiles).code, 0);
  expect(0, {"check " + tiles + " --levels 1-9"});
  const auto beyond = run_tind("check " + tiles + " --levels 3-9");
  EXPECT_EQ(beyond.code, 2) << beyond.out;
  EXPECT_NE(beyond.out.find("levels 0 to 2"), std::string::npos) << beyond.out;
}

TEST_F(ExitCode, OfAServerThatDoesNotAnswerWithItsReason) {
  const auto ran = run_tind("plan http://127.0.0.1:1/x --position 1,2,3 --velocity 1,1,1");
  EXPECT_EQ(ran.code, 74) << ran.out;
  EXPECT_NE(ran.out.find("onnect"), std::string::npos) << ran.out;
}

/// A build whose terminal goes once it has begun, in a shell that did `before`.
test::Ran hung_up(const std::string& before, const std::string& tiles, int deepest) {
  return run_tind("build " + test::testdata("rainier.tif") + " -o '" + tiles + "' --levels 0-" +
                      std::to_string(deepest) + " & build=$!; until [ -e '" + tiles +
                      "/tind-lock' ] || ! kill -0 $build; do sleep 0.01; done; "
                      "kill -HUP $build; kill -HUP $build; wait $build; }",
                  before + "{");
}

TEST(Exit, a_terminal_that_goes_stops_a_build_as_a_signal_does) {
  const test::TempDir folder;
  const auto ran = hung_up("", folder.file("tiles"), 16);
  EXPECT_EQ(ran.code, 75) << ran.out;
  EXPECT_NE(ran.out.find("tind: stopped "), std::string::npos)
      << "what is at hand is finished, although a terminal says so twice: " << ran.out;
}

TEST(Exit, a_signal_that_is_ignored_stops_nothing) {
  const test::TempDir folder;
  const auto ran = hung_up("trap '' HUP; ", folder.file("tiles"), 9);
  EXPECT_EQ(ran.code, 0) << ran.out;
}

/// What would be opened in their place is a file that messages then go to.
TEST_F(ExitCode, ClosedDescriptorsAreNobodysFiles) {
  const std::string tiles = folder_.file("held"), said = folder_.file("said");
  ASSERT_EQ(run_tind("build " + dem_ + " --levels 0-2 -o " + tiles).code, 0);
  const std::string script = test::tind_binary() + " serve --as-root " + tiles +
                             " --listen 127.0.0.1:0 --jobs 0 <&- 2>&- >" + said +
                             " & for i in $(seq 600); do grep -q serving " + said +
                             " && break; sleep .05; done; readlink /proc/$!/fd/0 /proc/$!/fd/2 > " +
                             said + "; kill $!; wait $!";
  EXPECT_EQ(std::system(script.c_str()), 0);
  EXPECT_EQ(read_whole_file(said).value_or(""), "/dev/null\n/dev/null\n");
}

/// Who starts us may hear signals in a thread of its own, and block them in all others.
TEST_F(ExitCode, BlockedSignalsAreHeardAllTheSame) {
  const std::string tiles = folder_.file("blocked"), said = folder_.file("said");
  ASSERT_EQ(run_tind("build " + dem_ + " --levels 0-2 -o " + tiles).code, 0);
  const std::string script =
      "env --block-signal=TERM,INT,HUP " + test::tind_binary() + " serve --as-root " + tiles +
      " --listen 127.0.0.1:0 --jobs 0 2>&- >" + said +
      " & p=$!; for i in $(seq 600); do grep -q serving " + said +
      " && break; sleep .05; done; kill $p; (sleep 30; kill -9 $p) >/dev/null 2>&1 & " +
      "w=$!; wait $p; c=$?; kill $w; exit $c";
  EXPECT_EQ(std::system(script.c_str()), 0);
}

TEST_F(ExitCode, OfWrongDataStaysWhereTheReportIsLost) {
  const std::string tiles = folder_.file("wrong");
  ASSERT_EQ(run_tind("build " + dem_ + " --levels 0-2 -o " + tiles).code, 0);
  std::filesystem::resize_file(tiles + "/0/0/0.terrain", 100);
  const auto ran = run_tind("check " + tiles + " 2>&1 >/dev/full");
  EXPECT_EQ(ran.code, 65);
  EXPECT_NE(ran.out.find("cannot write to standard output"), std::string::npos) << ran.out;
}

TEST_F(ExitCode, OfTooFewDescriptorsNamesTheLimit) {
  const std::string tiles = folder_.file("few");
  ASSERT_EQ(run_tind("build " + dem_ + " --levels 0-2 -o " + tiles).code, 0);
  for (const char* const so_many : {"14", "16"}) {
    const auto ran = run_tind("serve " + tiles + " --as-root --listen 127.0.0.1:0 --jobs 0",
                              "ulimit -n " + std::string(so_many) + ";");
    EXPECT_EQ(ran.code, 74) << ran.out;
    EXPECT_NE(ran.out.find("Too many open files"), std::string::npos) << ran.out;
    EXPECT_NE(ran.out.find("ulimit -n"), std::string::npos) << ran.out;
  }
}

}  // namespace
}  // namespace tind
