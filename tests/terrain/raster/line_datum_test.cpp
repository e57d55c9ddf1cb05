#include "terrain/raster/gdal/vectors/line_datum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "terrain/raster/datums.h"
#include "terrain/raster/gdal/vectors/vector_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class LineDatum : public testing::Test {
 protected:
  const test::TempDir folder_;

  /// What is stated of a line of these coordinates. `crs`: empty for none.
  std::vector<StatedDatum> stated(const std::string& crs,
                                  const char* line = "[15.1,45.1,300],[15.2,45.2,300]") {
    std::ofstream out(folder_.file("l.geojson"));
    out << R"({"type":"FeatureCollection",)";
    if (!crs.empty()) out << R"("crs":{"type":"name","properties":{"name":")" << crs << R"("}},)";
    out << R"("features":[{"type":"Feature","properties":{},"geometry":{"type":"LineString",)"
        << R"("coordinates":[)" << line << "]}}]}";
    out.close();
    const auto read = read_vectors_on_globe(folder_.file("l.geojson"), DemInfo());
    EXPECT_TRUE(read) << read.error().what;
    return read ? read->stated : std::vector<StatedDatum>();
  }
};

const StatedDatum kEllipsoid{VerticalDatum::ellipsoid, "", "", false};

/// `source`: before it was converted.
DemInfo dem_above(const VerticalDatum& datum, const VerticalDatum& source) {
  DemInfo info;
  info.files = {"d.tif"};
  info.datum = datum, info.source_datum = source;
  return info;
}
DemInfo dem_above(const VerticalDatum& datum) { return dem_above(datum, datum); }
DemInfo dem_above(const char* crs) { return dem_above(datum_named(crs).value()); }

/// Empty: they are above the same; else the error, or the warnings.
std::string compared(const std::vector<StatedDatum>& stated, const DemInfo& dem) {
  const auto doubts = compare_datums("l.gpkg", stated, dem);
  if (!doubts) {
    EXPECT_EQ(doubts.error().code, Errc::invalid_argument);
    return "error: " + doubts.error().what;
  }
  std::string all;
  for (const std::string& doubt : *doubts) all += "warning: " + doubt + "\n";
  return all;
}

TEST_F(LineDatum, IsWhatACompoundCrsSays) {
  const auto egm96 = stated("EPSG:4326+5773");
  ASSERT_EQ(egm96.size(), 1u);
  EXPECT_EQ(egm96[0].datum, VerticalDatum::egm96);
  EXPECT_EQ(egm96[0].vertical, "EGM96 height");
  EXPECT_FALSE(egm96[0].downwards);
  EXPECT_THAT(stated("EPSG:4326"), IsEmpty());
  EXPECT_THAT(stated(""), IsEmpty()) << "GDAL says EPSG:4979 of all such GeoJSON";
}

TEST_F(LineDatum, IsThatOfLinesWithHeightsAlone) {
  EXPECT_THAT(stated("EPSG:4326+5773", "[15.1,45.1],[15.2,45.2]"), IsEmpty());
}

TEST_F(LineDatum, OfTheDemIsNoMatterWhateverTheUnit) {
  EXPECT_EQ(compared(stated("EPSG:4326+5773"), dem_above(VerticalDatum::egm96)), "");
  EXPECT_EQ(compared({}, dem_above(VerticalDatum::ellipsoid)), "");
  for (const char* lines : {"EPSG:4269+5703", "EPSG:4269+6360", "EPSG:4269+8228"})  // m, US ft, ft
    for (const char* heights : {"EPSG:5703", "EPSG:6360", "EPSG:4269+5703"})
      EXPECT_EQ(compared(stated(lines), dem_above(heights)), "") << lines << " " << heights;
  EXPECT_EQ(compared({kEllipsoid}, dem_above(VerticalDatum::ellipsoid)), "");
}

TEST_F(LineDatum, OfAnotherIsRefused) {
  const auto egm96 = stated("EPSG:4326+5773");
  ASSERT_EQ(egm96.size(), 1u);
  EXPECT_THAT(compared(egm96, dem_above(VerticalDatum::ellipsoid, VerticalDatum::egm96)),
              AllOf(HasSubstr("error: l.gpkg: says that its heights are above 'EGM96 height', and "
                              "those of the DEM, once converted, are above ellipsoid"),
                    HasSubstr("--to-datum egm96"), HasSubstr("--line-heights dem")));
  EXPECT_THAT(compared(egm96, dem_above("EPSG:5703")), HasSubstr("of the DEM are above EPSG:5703"));
  EXPECT_THAT(compared(stated("EPSG:4269+6360"), dem_above("EPSG:7837")), HasSubstr("error"));
  EXPECT_THAT(compared({kEllipsoid}, dem_above(VerticalDatum::egm96)),
              HasSubstr("error: l.gpkg: says that its heights are above ellipsoid"));
  // One layer is enough.
  EXPECT_THAT(compared({egm96[0], kEllipsoid}, dem_above(VerticalDatum::egm96)),
              HasSubstr("error"));
}

TEST_F(LineDatum, ThatNobodyCanCompareIsAWarning) {
  const auto egm96 = stated("EPSG:4326+5773");
  EXPECT_THAT(compared(egm96, dem_above(VerticalDatum::unknown)),
              HasSubstr("warning: heights of l.gpkg are above 'EGM96 height', and of d.tif nobody "
                        "says above what"));
  EXPECT_THAT(compared(egm96, dem_above(VerticalDatum(VerticalDatum::file, "/g/own.gtx"))),
              HasSubstr("warning: heights of l.gpkg are above 'EGM96 height', and of d.tif above "
                        "own.gtx"));
  const StatedDatum local{VerticalDatum::unknown, "Town datum", "Town", false};
  EXPECT_THAT(compared({local}, dem_above(VerticalDatum::egm96)),
              HasSubstr("warning: heights of l.gpkg are above 'Town datum', which PROJ does not"));
  DemInfo same = dem_above(VerticalDatum::unknown);
  same.vertical_crs = "Town datum";
  EXPECT_EQ(compared({local}, same), "");
}

TEST_F(LineDatum, ThatWasPerhapsNeverSaidIsAWarning) {
  StatedDatum converted = kEllipsoid;
  converted.perhaps_unsaid = true;
  EXPECT_THAT(compared({converted}, dem_above(VerticalDatum::egm96)),
              AllOf(HasSubstr("warning"), HasSubstr("EPSG:4979"), HasSubstr("above egm96")));
  EXPECT_EQ(compared({converted}, dem_above(VerticalDatum::ellipsoid)), "");
}

TEST_F(LineDatum, OfDepthsIsRefused) {
  EXPECT_THAT(compared(stated("EPSG:4326+5715"), dem_above(VerticalDatum::unknown)),
              HasSubstr("counts downwards"));
}

}  // namespace
}  // namespace tind
