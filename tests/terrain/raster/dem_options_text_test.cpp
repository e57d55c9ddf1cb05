// What users type about a DEM, wherever they type it.

#include "terrain/raster/dem_options_text.h"

#include <gtest/gtest.h>

#include <string>

namespace tind {
namespace {

TEST(DemOptionsText, EachTextSetsItsMember) {
  DemOptions options;
  ASSERT_TRUE(set_dem_option("from_datum", "egm96", options));
  EXPECT_EQ(options.from_datum, VerticalDatum::egm96);
  ASSERT_TRUE(set_dem_option("to_datum", "ellipsoid", options));
  EXPECT_EQ(options.to_datum, TargetDatum::ellipsoid);
  ASSERT_TRUE(set_dem_option("to_datum", "egm2008", options));
  EXPECT_EQ(options.to_datum.named, VerticalDatum::egm2008);
  ASSERT_TRUE(set_dem_option("from_datum", "EPSG:5703", options));
  EXPECT_EQ(options.from_datum, VerticalDatum(VerticalDatum::crs, "EPSG:5703"));
  ASSERT_TRUE(set_dem_option("to_datum", "same", options));
  EXPECT_EQ(options.to_datum, TargetDatum::same);
  ASSERT_TRUE(set_dem_option("nodata", "-1,none", options));
  EXPECT_EQ(options.nodata, std::vector<double>{-1});
  EXPECT_TRUE(options.ignore_declared_nodata);
  ASSERT_TRUE(set_dem_option("crs", "EPSG:25832", options));
  EXPECT_EQ(options.crs, "EPSG:25832");
  ASSERT_TRUE(set_dem_option("band", "3", options));
  EXPECT_EQ(options.band, 3);
  ASSERT_TRUE(set_dem_option("encoding", "terrarium", options));
  EXPECT_EQ(options.encoding, HeightEncoding::terrarium);
  ASSERT_TRUE(set_dem_option("scale", "0.1", options));
  EXPECT_EQ(options.scale, 0.1);
  ASSERT_TRUE(set_dem_option("offset", "-500", options));
  EXPECT_EQ(options.offset, -500);
  ASSERT_TRUE(set_dem_option("accuracy", "le90=4", options));
  EXPECT_EQ(options.accuracy, (VerticalAccuracy{AccuracyKind::le90, 4}));
  ASSERT_TRUE(set_dem_option("accuracy", "2.5", options));
  EXPECT_EQ(options.accuracy, (VerticalAccuracy{AccuracyKind::unspecified, 2.5}));
}

TEST(DemOptionsText, WhatMakesNoSenseIsRefused) {
  DemOptions options;
  for (const DemOptionText& one : dem_option_texts())
    for (const char* text : {"", "nonsense", "-9999,"}) {
      if (std::string(one.name) == "crs" && *text) continue;  // that is PROJ's to say
      const auto set = set_dem_option(one.name, text, options);
      ASSERT_FALSE(set) << one.name << " = " << text;
      EXPECT_EQ(set.error().code, Errc::invalid_argument);
    }
  EXPECT_EQ(set_dem_option("from-datum", "egm96", options).error().code, Errc::not_found);
}

}  // namespace
}  // namespace tind
