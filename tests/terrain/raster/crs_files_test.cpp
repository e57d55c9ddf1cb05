// The CRS of a file may name grids, which PROJ opens: no file says which of ours that are.

#include <gtest/gtest.h>

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

TEST(CrsFiles, PathsOfGridsAreRefused) {
  const test::TempDir folder;
  const std::string grid = folder.file("secret.gsb");
  std::ofstream(grid) << "not a grid";
  for (const auto& prj : {extension(grid), extension("@" + grid), extension("a.gsb," + grid),
                          extension("../secret.gsb"), extension("~/secret.gsb"), geoid(grid)})
    EXPECT_FALSE(opens(folder, prj)) << prj;
}

TEST(CrsFiles, NamesOfGridsAreNot) {
  const test::TempDir folder;
  EXPECT_TRUE(opens(folder, geoid("none.gtx")));
}

}  // namespace
}  // namespace tind
