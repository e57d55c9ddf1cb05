// A DEM on another machine gives the heights of the same file here, or an error: never a void,
// never heights of two versions.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "terrain/base/file_io.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/dem_source.h"
#include "tests/support/s3_stub.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using Fault = S3Stub::Fault;
using testing::HasSubstr;

class RemoteSourceTest : public testing::Test {
 protected:
  S3Stub stub;
  S3Environment environment{stub, 20, 2};
  const std::string bytes = *read_whole_file(test::testdata("rainier.tif"));

  RemoteSourceTest() { stub.put("bucket/dem.tif", bytes); }

  static Result<std::shared_ptr<const DemSource>> open(const std::string& name) {
    return DemSource::open(std::vector{name});
  }
  static Result<HeightGrid> all_of(const DemSource& dem) {
    return dem.read(0, 0, int(dem.info().cols), int(dem.info().rows));
  }
  static bool same(const HeightGrid& a, const HeightGrid& b) {
    if (a.cols() != b.cols() || a.rows() != b.rows()) return false;
    for (int row = 0; row < a.rows(); ++row)
      for (int col = 0; col < a.cols(); ++col) {
        const float x = a.at(col, row), y = b.at(col, row);
        if (!(x == y || (std::isnan(x) && std::isnan(y)))) return false;
      }
    return true;
  }
};

TEST_F(RemoteSourceTest, HeightsAreThoseOfTheFile) {
  const auto here = open(test::testdata("rainier.tif"));
  ASSERT_TRUE(here);
  const auto wanted = all_of(**here);
  ASSERT_TRUE(wanted);
  for (const std::string& name :
       {std::string("s3://bucket/dem.tif"), stub.address() + "/bucket/dem.tif"}) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(is_remote_dem(name));
    const auto there = open(name);
    ASSERT_TRUE(there) << there.error().what;
    EXPECT_EQ((*there)->info().cols, (*here)->info().cols);
    EXPECT_EQ((*there)->info().crs_name, (*here)->info().crs_name);
    const auto heights = all_of(**there);
    ASSERT_TRUE(heights) << heights.error().what;
    EXPECT_TRUE(same(*heights, *wanted));
    EXPECT_TRUE((*there)->unchanged());
  }
  EXPECT_EQ(stub.count("HEAD"), 2) << "of unchanged(): no other file is looked for";
}

TEST_F(RemoteSourceTest, AServerThatBreaksGivesErrorsNeverVoids) {
  const auto here = open(test::testdata("rainier.tif"));
  ASSERT_TRUE(here);
  const auto wanted = all_of(**here);
  for (const Fault fault :
       {Fault::e500, Fault::e403, Fault::reset, Fault::cut, Fault::short_body, Fault::no_range,
        Fault::wrong_range, Fault::error_200, Fault::redirect}) {
    SCOPED_TRACE(int(fault));
    stub.fail_next("GET", fault, 1000);
    const auto never = open("s3://bucket/dem.tif");
    ASSERT_FALSE(never);
    EXPECT_EQ(never.error().code, Errc::io) << never.error().what;
    stub.mend();
    const auto there = open("s3://bucket/dem.tif");
    ASSERT_TRUE(there) << there.error().what;
    stub.fail_next("GET", fault, 1000);
    const auto broken = all_of(**there);
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, Errc::io) << broken.error().what;
    stub.mend();
    const auto again = all_of(**there);
    ASSERT_TRUE(again) << again.error().what;
    EXPECT_TRUE(same(*again, *wanted));
  }
}

TEST_F(RemoteSourceTest, WhatBecomesAnotherIsRefused) {
  const auto there = open("s3://bucket/dem.tif");
  ASSERT_TRUE(there) << there.error().what;
  std::string other = bytes;
  other.back() = char(other.back() ^ 1);
  stub.put("bucket/dem.tif", other);
  const auto read = all_of(**there);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Errc::io) << read.error().what;
  EXPECT_FALSE((*there)->unchanged());
  const auto anew = open("s3://bucket/dem.tif");
  ASSERT_TRUE(anew);
  EXPECT_NE((*anew)->info().fingerprint, (*there)->info().fingerprint);
}

TEST_F(RemoteSourceTest, OnlyGeoTiffsOfPlacesThatAreAllowed) {
  stub.put("bucket/vrt.tif",
           "<VRTDataset rasterXSize=\"1\" rasterYSize=\"1\"><VRTRasterBand dataType=\"Byte\" "
           "band=\"1\"/></VRTDataset>");
  const auto vrt =
      DemSource::open(std::vector<std::string>{"s3://bucket/vrt.tif"}, {.allow_vrt = true});
  ASSERT_FALSE(vrt);
  EXPECT_EQ(vrt.error().code, Errc::bad_data);
  EXPECT_EQ(open("s3://bucket/none.tif").error().code, Errc::not_found);
  const auto plain = open("http://192.0.2.1/dem.tif");
  ASSERT_FALSE(plain);
  EXPECT_EQ(plain.error().code, Errc::invalid_argument);
  EXPECT_THAT(plain.error().what, HasSubstr("https"));
}

}  // namespace
}  // namespace tind
