// No input is overwritten, and no output by another.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "terrain/base/file_io.h"
#include "tests/support/program.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using test::run_tind;

class OutputPaths : public testing::Test {
 protected:
  OutputPaths() {
    fs::copy_file(test::testdata("desert.asc"), dem);
    fs::create_directories(folder.file("f"));
    fs::copy_file(dem, folder.file("f/a.asc"));
    fs::create_symlink(dem, folder.file("link.asc"));
    EXPECT_TRUE(write_whole_file(folder.file("l.txt"), "f/a.asc\n"));
  }
  void refused(const std::string& line, const std::string& why = "name another output") {
    const std::string before = *read_whole_file(dem),
                      member = *read_whole_file(folder.file("f/a.asc"));
    const auto ran = run_tind(line, "cd " + folder.file("") + ";");
    EXPECT_EQ(ran.code, 2) << line << "\n" << ran.out;
    EXPECT_NE(ran.out.find(why), std::string::npos) << line << "\n" << ran.out;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 1) << ran.out;
    EXPECT_EQ(*read_whole_file(dem), before) << line;
    EXPECT_EQ(*read_whole_file(folder.file("f/a.asc")), member) << line;
    EXPECT_FALSE(fs::exists(folder.file("o.ply"))) << line;
  }

  test::TempDir folder;
  std::string dem = folder.file("d.asc");
};

TEST_F(OutputPaths, an_input_is_refused_by_every_command_whatever_its_name) {
  const std::string stop = " --max-error 5 ";
  refused("simplify d.asc -o d.asc --format ply" + stop);
  refused("simplify d.asc -o f/../d.asc --format ply" + stop);
  refused("simplify d.asc -o link.asc --format ply" + stop);
  refused("simplify link.asc -o o.ply --report d.asc" + stop);
  refused("simplify d.asc -o o.ply --raster ./d.asc" + stop);
  refused("simplify f -o o.ply --error-raster f/a.asc" + stop);
  refused("simplify @l.txt -o o.ply --report f/a.asc" + stop);
  refused("simplify @l.txt -o o.ply --report l.txt" + stop);
  refused("refine d.asc -o d.asc --format ply --bbox 0,0,1,1");
  refused("progressive d.asc -o d.asc");
  refused("between d.asc f/a.asc -o f/a.asc");
  refused("extract d.asc -o d.asc --format ply");
  refused("compare d.asc --max-error 5 --csv d.asc");
  refused("explain f 0/0/0 --source d.asc --png d.asc");
  fs::copy_file(dem, folder.file("d.3tz"));
  fs::copy_file(dem, folder.file("l.r16.json"));
  refused("build d.3tz -o t --format 3dtiles --archive d.3tz");
  refused("build d.asc -o t --format 3dtiles --archive d.3tz --flatten d.3tz");
  refused("build d.asc -o t --format 3dtiles --archive d.3tz --drape d.3tz");
  refused("build --layer low=d.3tz -o t --format 3dtiles --archive d.3tz");
  refused("export d.asc --format unreal -o l.r16 --flatten l.r16.json");
  EXPECT_EQ(*read_whole_file(folder.file("d.3tz")), *read_whole_file(dem));
  EXPECT_EQ(*read_whole_file(folder.file("l.r16.json")), *read_whole_file(dem));
}

TEST_F(OutputPaths, a_file_read_beside_an_input_is_refused) {
  refused("simplify d.asc -o o.ply --report d.prj --max-error 5");
  refused("simplify d.asc -o o.ply --report d.asc.aux.xml --max-error 5");
  refused("refine d.asc -o d.prj --format ply --bbox 0,0,1,1");
}

TEST_F(OutputPaths, two_outputs_on_one_file_are_refused) {
  const std::string why = "each output needs its own", stop = " --max-error 5";
  refused("simplify d.asc -o o.ply --report f/../o.ply" + stop, why);
  refused("simplify d.asc -o o.ply --raster f/r.asc --error-raster f/./r.asc" + stop, why);
  refused("simplify d.asc -o o.ply --raster f/r.asc --report f/r.prj" + stop, why);
  refused("compare d.asc --max-error 5 --csv f/x --html ./f/x", why);
}

TEST_F(OutputPaths, other_names_and_devices_are_written) {
  const std::string in = "cd " + folder.file("") + ";";
  const auto ran = run_tind("simplify d.asc -o d.xml --max-error 5 --report /dev/null", in);
  EXPECT_EQ(ran.code, 0) << ran.out;
  for (int twice = 0; twice < 2; ++twice)
    EXPECT_EQ(run_tind("simplify f -o f.ply --max-error 5 --raster f/../r.asc", in).code, 0);
}

TEST_F(OutputPaths, a_material_library_is_read_beside_an_obj_alone) {
  const auto ran =
      run_tind("simplify d.asc --max-error 50 -o d.obj", "cd " + folder.file("") + ";");
  EXPECT_EQ(ran.code, 0) << ran.out;
  EXPECT_TRUE(fs::exists(folder.file("d.obj")));
  refused("simplify d.obj --max-error 50 -o d.mtl --format ply");
}

TEST_F(OutputPaths, tiles_are_not_built_among_dems) {
  refused("build f -o f --from-datum ellipsoid", "name a folder of its own");
  refused("build f/a.asc -o ./f/ --from-datum ellipsoid", "name a folder of its own");
}

TEST_F(OutputPaths, a_file_that_an_input_names_is_refused) {
  const std::string vrt =
      "<VRTDataset rasterXSize=\"2\" rasterYSize=\"2\"><VRTRasterBand dataType=\"Float32\" "
      "band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">";
  const std::string end = "</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>";
  EXPECT_TRUE(write_whole_file(folder.file("inner.vrt"), vrt + "d.asc" + end));
  EXPECT_TRUE(write_whole_file(folder.file("outer.vrt"), vrt + "inner.vrt" + end));
  const std::string stop = " --allow-vrt --max-error 5 ";
  refused("simplify inner.vrt -o d.asc --format ply" + stop);
  refused("simplify inner.vrt -o o.ply --report d.prj" + stop);
  refused("simplify outer.vrt -o o.ply --report inner.vrt" + stop);
  refused("simplify outer.vrt -o o.ply --raster f/../d.asc" + stop);
  EXPECT_TRUE(write_whole_file(folder.file("q.obj"),
                               "mtllib look.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_TRUE(write_whole_file(folder.file("look.mtl"),
                               "newmtl a\nmap_Kd -clamp on q.png\nnewmtl b\nbump d.asc\n"));
  EXPECT_TRUE(write_whole_file(folder.file("q.ply"),
                               "ply\nformat ascii 1.0\ncomment TextureFile q.png\nelement vertex "
                               "0\nend_header\n"));
  for (const char* mesh : {"q.obj", "q.ply"}) {
    const std::string start = std::string("simplify ") + mesh + " --ratio 1 --format ply -o ";
    refused(start + "q.png");
    refused(start + "f/../q.png");
  }
  refused("simplify q.obj --ratio 1 --format ply -o d.asc");
  refused("simplify q.obj --ratio 1 --format ply -o look.mtl");
  EXPECT_FALSE(fs::exists(folder.file("q.png")));
}

}  // namespace
}  // namespace tind
