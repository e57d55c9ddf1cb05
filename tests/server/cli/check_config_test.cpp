// tind serve --check-config: it says what a start would say, and leaves nothing behind.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
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

Ran check(const std::string& what) { return run_tind("serve --check-config " + what); }

TEST(CheckConfig, FoldersThatCannotBeWrittenToAreNamedBeforeTheStart) {
  const tind::test::TempDir dir;
  const std::string file = dir.file("file");
  std::ofstream(file) << "no folder";
  const Ran checked = run_tind("serve " + testdata("rainier.tif") + " --check-config --jobs-dir " +
                               file + "/jobs --index-dir " + file + "/index");
  EXPECT_EQ(checked.code, 74) << "no user may start it";
  EXPECT_THAT(checked.out, HasSubstr("jobs-dir: " + file + "/jobs: Not a directory"));
  EXPECT_THAT(checked.out, HasSubstr("index-dir: " + file + "/index: Not a directory"));
  EXPECT_THAT(run_tind("serve " + testdata("rainier.tif") + " --check-config --jobs-dir " +
                       dir.file("new/folder"))
                  .out,
              Not(HasSubstr("jobs-dir")));
  EXPECT_FALSE(std::filesystem::exists(dir.file("new")));
}

TEST(CheckConfig, FindsWhatTheStartWouldFind) {
  const tind::test::TempDir dir;
  const std::string dem = dir.file("void.asc");
  std::ofstream(dem) << "ncols 2\nnrows 2\nxllcorner 7\nyllcorner 46\ncellsize 0.001\n"
                        "NODATA_value -9999\n-9999 -9999\n-9999 -9999\n";
  const Ran started = run_tind("serve --crs EPSG:4326 " + dem + " --listen 127.0.0.1:0");
  const Ran both = run_tind("serve /nowhere1.tif /nowhere2.tif --check-config");
  EXPECT_EQ(both.code, 69);
  for (const char* said : {"/nowhere1.tif", "/nowhere2.tif", "2 datasets cannot be served"})
    EXPECT_NE(both.out.find(said), std::string::npos) << both.out;
  const Ran checked = run_tind("serve --crs EPSG:4326 " + dem + " --check-config");
  EXPECT_EQ(started.code, 65) << started.out;
  EXPECT_EQ(checked.code, 65) << checked.out;
  EXPECT_THAT(checked.out, HasSubstr(dem));
  EXPECT_EQ(run_tind("serve " + testdata("rainier.tif") + " --check-config").code, 0);
}

TEST(CheckConfig, WarnsAsAStartDoesWhereStrangersMayAskEverything) {
  const auto checked = [](const std::string& listen) {
    return run_tind("serve " + testdata("rainier.tif") + " --check-config --listen " + listen);
  };
  const Ran open = checked("0.0.0.0:8080");
  EXPECT_EQ(open.code, 0) << open.out;
  EXPECT_THAT(open.out, HasSubstr("0.0.0.0:8080 without keys"));
  EXPECT_THAT(checked("127.0.0.1:8080").out, Not(HasSubstr("without keys")));
}

TEST(CheckConfig, NamesTheTableAndItsLine) {
  const tind::test::TempDir dir;
  const std::string config = dir.file("tind.toml");
  std::ofstream(config) << "cache_mb = 9\n\n[[dataset]]\nname = \"peak\"\nfiles = [\""
                        << testdata("rainier.tif") << "\"]\ndrape = \"" << dir.file("gone.png")
                        << "\"\n";
  const Ran started = run_tind("serve --listen 127.0.0.1:0 --config " + config);
  const Ran checked = check("--config " + config);
  EXPECT_NE(started.code, 0);
  EXPECT_EQ(checked.code, started.code);
  EXPECT_THAT(started.out, HasSubstr(checked.out));  // beside its log
  EXPECT_THAT(checked.out, HasSubstr(config + ":3"));
  EXPECT_THAT(checked.out, HasSubstr("gone.png"));
}

TEST(CheckConfig, LeavesAloneWhatAStartWouldLeaveAlone) {
  const tind::test::TempDir dir;
  const std::string folder = dir.file("catalog");
  fs::create_directory(folder);
  fs::copy_file(testdata("rainier.tif"), folder + "/one.tif");
  EXPECT_EQ(check("--catalog " + folder).code, 0);
  std::ofstream(folder + "/other.tif") << "no raster";
  fs::copy_file(testdata("bigtujunga_crop.tif"), folder + "/one.tiff");  // of the same name
  const Ran two = check("--catalog " + folder);
  EXPECT_EQ(two.code, 65) << two.out;
  EXPECT_THAT(two.out, HasSubstr("2 of the catalog's entries"));
  EXPECT_THAT(two.out, HasSubstr("other.tif"));
  EXPECT_THAT(two.out, HasSubstr("rename one of them"));
  EXPECT_THAT(two.out, Not(HasSubstr("the configuration is valid")));
}

TEST(CheckConfig, BesideThePrintedConfigurationItSpeaksOnStderrOnly) {
  const Ran printed = run_tind("serve --print-config " + testdata("rainier.tif"));
  const Ran both = check("--print-config --listen 0.0.0.0:8080 " + testdata("rainier.tif"));
  EXPECT_EQ(both.code, 0);
  EXPECT_THAT(both.out, HasSubstr("without keys"));
  EXPECT_THAT(both.answer, Not(HasSubstr("without keys")));
  EXPECT_EQ(std::ranges::count(both.answer, '\n'), std::ranges::count(printed.answer, '\n'));
}

}  // namespace
