// The CRS of a file may name grids, which PROJ opens: no file says which of ours that are.

#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

/// A CRS whose way to WGS84 is a grid of that name.
std::string extension(const std::string& grid) {
  return R"(GEOGCS["x",DATUM["d",SPHEROID["e",6378137,298.3],EXTENSION["PROJ4_GRIDS",")" + grid +
         R"("]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
}

std::string geoid(const std::string& grid) {
  return R"(COMPD_CS["c",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
         R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],VERT_CS["v",)"
         R"(VERT_DATUM["d",2005,EXTENSION["PROJ4_GRIDS",")" +
         grid + R"("]],UNIT["metre",1],AXIS["Up",UP]]])";
}

bool opens(const test::TempDir& folder, const std::string& prj) {
  std::ofstream(folder.file("d.asc"))
      << "ncols 2\nnrows 2\nxllcorner 8\nyllcorner 47\ncellsize 0.01\n1 2\n3 4\n";
  std::ofstream(folder.file("d.prj")) << prj;
  const std::string dem = folder.file("d.asc");
  return DemSource::open({&dem, 1}).has_value();
}

/// How often a file was opened since this was made.
class Openings {
 public:
  explicit Openings(const std::string& file) : queue_(inotify_init1(IN_NONBLOCK)) {
    watched_ = inotify_add_watch(queue_, file.c_str(), IN_OPEN) >= 0;
  }
  ~Openings() { close(queue_); }
  int count() {
    EXPECT_TRUE(watched_);
    int found = 0;
    inotify_event event{};
    while (read(queue_, &event, sizeof event) == ssize_t(sizeof event)) ++found;
    return found;
  }

 private:
  int queue_;
  bool watched_ = false;
};

TEST(CrsFiles, PathsOfGridsAreRefused) {
  const test::TempDir folder;
  const std::string grid = folder.file("secret.gsb");
  std::ofstream(grid) << "not a grid";
  Openings openings(grid);
  for (const auto& prj : {extension(grid), extension("@" + grid), extension("a.gsb," + grid),
                          extension("../secret.gsb"), extension("~/secret.gsb"), geoid(grid)})
    EXPECT_FALSE(opens(folder, prj)) << prj;
  EXPECT_EQ(openings.count(), 0);
}

TEST(CrsFiles, AnOperatorMayNameThem) {
  const test::TempDir folder;
  const std::string grid = folder.file("mine.gsb"), dem = folder.file("d.asc");
  std::ofstream(grid) << "not a grid";
  EXPECT_TRUE(opens(folder, ""));
  Openings openings(grid);
  DemOptions options;
  options.crs = "+proj=longlat +ellps=bessel +nadgrids=" + grid + " +no_defs";
  (void)DemSource::open({&dem, 1}, options);
  EXPECT_GT(openings.count(), 0);
}

TEST(CrsFiles, NamesOfGridsAreNot) {
  const test::TempDir folder;
  EXPECT_TRUE(opens(folder, geoid("none.gtx")));
}

// GDAL calls the datum of a projected file an ensemble where the process has seen EPSG's WGS 84.
TEST(Crs, IsInTheSameWordsWhateverElseTheProcessHasSeen) {
  const auto words = [](const std::string& dem, const std::string& crs) {
    DemOptions options;
    options.crs = crs;
    const auto opened = DemSource::open({&dem, 1}, options);
    EXPECT_TRUE(opened) << opened.error().what;
    return opened ? (*opened)->info().crs_wkt : std::string();
  };
  const std::string dem = test::testdata("bigtujunga_crop.tif");
  const std::string first = words(dem, "");
  EXPECT_NE(first.find("DATUM[\"World Geodetic System 1984\",ELLIPSOID"), first.npos) << first;
  (void)words(test::testdata("desert.asc"), "EPSG:3857");
  EXPECT_EQ(words(dem, ""), first);
  EXPECT_EQ(words(dem, "EPSG:25832").find("ENSEMBLE"), first.npos);
}

}  // namespace
}  // namespace tind
