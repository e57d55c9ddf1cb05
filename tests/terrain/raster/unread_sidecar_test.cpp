#include "terrain/raster/gdal/heights/unread_sidecar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::HasSubstr;

constexpr const char* kSaid = R"(<PAMDataset>
  <PAMRasterBand band="1">
    <NoDataValue>-1</NoDataValue><UnitType> ft
    </UnitType><Offset>100</Offset><Scale>0.5</Scale>
    <Metadata><MDI key="STATISTICS_MINIMUM">4</MDI></Metadata>
  </PAMRasterBand>
</PAMDataset>)";

TEST(UnreadSidecar, SaysWhatIsNotAsItIsRead) {
  const test::TempDir folder;
  const std::string dem = folder.file("a.tif");
  EXPECT_EQ(gdal::unread_sidecar(dem, {}), "") << "there is none";
  std::ofstream(dem + ".aux.xml") << kSaid;
  EXPECT_EQ(gdal::unread_sidecar(dem, {}),
            dem + ".aux.xml says unit ft, scale 0.5, offset 100, nodata -1");
  EXPECT_EQ(gdal::unread_sidecar(
                dem, {.type = {}, .scale = 0.5, .offset = 100, .unit_m = 0.3048, .nodata = {-1}}),
            "");
  std::ofstream(dem + ".aux.xml")
      << "<PAMDataset><UnitType>m</UnitType><Scale>1</Scale><NoDataValue";
  EXPECT_EQ(gdal::unread_sidecar(dem, {}), "");
}

TEST(UnreadSidecar, SaysItsCrsWhereTheRasterHasNone) {
  const test::TempDir folder;
  const std::string dem = folder.file("a.tif");
  std::ofstream(dem + ".aux.xml") << R"(<PAMDataset>
  <SRS dataAxisToSRSAxisMapping="1,2,3">PROJCRS["WGS 84 / UTM zone 32N",BASEGEOGCRS["WGS 84"]]</SRS>
</PAMDataset>)";
  EXPECT_EQ(gdal::unread_sidecar(dem, {}, false), dem + ".aux.xml says CRS WGS 84 / UTM zone 32N");
  EXPECT_EQ(gdal::unread_sidecar(dem, {}, true), "");
}

TEST(UnreadSidecar, IsToldWhereADemIsOpened) {
  const test::TempDir folder;
  const std::string dem = folder.file("a.asc");
  std::ofstream(dem) << "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n";
  std::ofstream(dem + ".aux.xml") << kSaid;
  const auto source = DemSource::open(std::vector{dem});
  ASSERT_TRUE(source) << source.error().what;
  EXPECT_THAT((*source)->info().warnings, testing::Contains(HasSubstr("says unit ft, scale 0.5")));
}

TEST(UnreadSidecar, APrjThatGivesNoCrsIsTold) {
  const test::TempDir folder;
  const std::string dem = folder.file("a.asc");
  std::ofstream(dem) << "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n";
  const auto warnings = [&](const DemOptions& options = {}) {
    const auto source = DemSource::open(std::vector{dem}, options);
    return source ? (*source)->info().warnings : std::vector{source.error().what};
  };
  EXPECT_THAT(warnings(), testing::IsEmpty()) << "there is none";
  std::ofstream(folder.file("a.prj")) << "UTM zone 32, more or less";
  EXPECT_THAT(warnings(), testing::ElementsAre(HasSubstr("a.prj: gives the raster no CRS")));
  EXPECT_THAT(warnings({.crs = "EPSG:25832"}), testing::IsEmpty());
}

TEST(GroundControlPoints, MakeNoGrid) {
  const test::TempDir folder;
  std::ofstream(folder.file("a.asc"))
      << "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n";
  const std::string vrt = folder.file("a.vrt");
  std::ofstream(vrt)
      << R"(<VRTDataset rasterXSize="2" rasterYSize="2"><GCPList Projection="EPSG:4326">
    <GCP Id="" Pixel="0" Line="0" X="7" Y="47"/><GCP Id="" Pixel="2" Line="0" X="8" Y="47"/>
    <GCP Id="" Pixel="0" Line="2" X="7" Y="46"/></GCPList>
    <VRTRasterBand dataType="Float32" band="1"><SimpleSource>
    <SourceFilename relativeToVRT="1">a.asc</SourceFilename><SourceBand>1</SourceBand>
    </SimpleSource></VRTRasterBand></VRTDataset>)";
  const auto source = DemSource::open(std::vector{vrt}, {.allow_vrt = true});
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().what, HasSubstr("gdalwarp"));
}

}  // namespace
}  // namespace tind
