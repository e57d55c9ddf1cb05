// Classes of a raster at places: those of the pixels there, with names and colours as files say
// them; what are no classes is refused.

#include "terrain/raster/land_cover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/support/globe_raster.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using ::testing::HasSubstr;

constexpr const char* kWgs84 =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
    R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";

class Cover : public ::testing::Test {
 protected:
  static constexpr int kNone = 77;
  test::TempDir folder_;

  /// 16 bits with a sign, pixels of 0.01 degrees from 7, 46 on to the east and the south.
  std::string raster(const std::string& name, int side,
                     const std::function<int(int, int)>& number) {
    std::ofstream(folder_.file(name + ".prj")) << kWgs84;
    std::ofstream(folder_.file(name + ".hdr"))
        << "BYTEORDER I\nLAYOUT BIL\nNROWS " << side << "\nNCOLS " << side
        << "\nNBANDS 1\nNBITS 16\nPIXELTYPE SIGNEDINT\nNODATA " << kNone
        << "\nULXMAP 7.005\nULYMAP 45.995\nXDIM 0.01\nYDIM 0.01\n";
    std::ofstream out(folder_.file(name + ".bil"), std::ios::binary);
    for (int r = 0; r < side; ++r)
      for (int c = 0; c < side; ++c) {
        const int value = number(c, r);
        out << char(value & 255) << char(value >> 8 & 255);
      }
    return folder_.file(name + ".bil");
  }
  void say_beside(const std::string& path, const std::string& of_band) {
    std::ofstream(path + ".aux.xml")
        << "<PAMDataset><PAMRasterBand band=\"1\">" << of_band << "</PAMRasterBand></PAMDataset>";
  }
  /// The number of the class, or -1.
  static int at(const LandCover& cover, Geographic place) {
    std::optional<std::uint16_t> index;
    cover.at({&place, 1}, {&index, 1});
    return index ? cover.classes()[*index].number : -1;
  }
  static std::string refusal(const std::string& path, Errc code = Errc::bad_data) {
    const auto cover = LandCover::open(path);
    EXPECT_FALSE(cover);
    if (cover) return {};
    EXPECT_EQ(cover.error().code, code);
    return cover.error().what;
  }
};

TEST_F(Cover, OfTheGlobeHasClassesAllAround) {
  const auto opened = LandCover::open(test::globe_raster(folder_, 5));
  ASSERT_TRUE(opened) << opened.error().what;
  for (const double lon : test::kAroundTheGlobe) EXPECT_EQ(at(**opened, {lon, 3}), 5) << lon;
}

TEST_F(Cover, IsTheClassOfThePixelThere) {
  const auto opened = LandCover::open(raster("a", 8, [](int c, int r) {
    return r == 7 ? kNone : c == 3 ? 300 : 10 * (c % 2);
  }));
  ASSERT_TRUE(opened) << opened.error().what;
  const LandCover& cover = **opened;
  ASSERT_EQ(cover.classes().size(), 3u);
  EXPECT_EQ(cover.classes()[0], (CoverClass{0, "", {}}));
  EXPECT_EQ(cover.classes()[2].number, 300);
  EXPECT_EQ(at(cover, {7.001, 45.999}), 0);
  EXPECT_EQ(at(cover, {7.0199, 45.985}), 10);
  EXPECT_EQ(at(cover, {7.0301, 45.985}), 300);
  EXPECT_EQ(at(cover, {7.0399, 45.985}), 300);
  EXPECT_EQ(at(cover, {7.0401, 45.985}), 0);
  EXPECT_EQ(at(cover, {7.035, 45.925}), -1) << "no data";
  EXPECT_EQ(at(cover, {6.999, 45.985}), -1) << "beyond";
  EXPECT_EQ(at(cover, {7.035, 45.919}), -1);
}

TEST_F(Cover, NamesAndColoursStandBesideTheRaster) {
  const std::string path = raster("named", 2, [](int c, int r) { return 1 + c + r; });
  say_beside(path,
             "<CategoryNames><Category/><Category>Water</Category><Category/></CategoryNames>"
             "<GDALRasterAttributeTable>"
             "<FieldDefn index=\"0\"><Name>v</Name><Type>0</Type><Usage>5</Usage></FieldDefn>"
             "<FieldDefn index=\"1\"><Name>n</Name><Type>2</Type><Usage>2</Usage></FieldDefn>"
             "<FieldDefn index=\"2\"><Name>r</Name><Type>0</Type><Usage>6</Usage></FieldDefn>"
             "<FieldDefn index=\"3\"><Name>g</Name><Type>0</Type><Usage>7</Usage></FieldDefn>"
             "<FieldDefn index=\"4\"><Name>b</Name><Type>0</Type><Usage>8</Usage></FieldDefn>"
             "<Row index=\"0\"><F>1</F><F>not this</F><F>0</F><F>0</F><F>200</F></Row>"
             "<Row index=\"1\"><F>3</F><F>Wald</F><F>1</F><F>300</F><F>3</F></Row>"
             "</GDALRasterAttributeTable>");
  const auto opened = LandCover::open(path);
  ASSERT_TRUE(opened) << opened.error().what;
  const std::vector<CoverClass>& classes = (*opened)->classes();
  ASSERT_EQ(classes.size(), 3u);
  EXPECT_EQ(classes[0], (CoverClass{1, "Water", {{0, 0, 200}}}));
  EXPECT_EQ(classes[1], (CoverClass{2, "", {}}));
  EXPECT_EQ(classes[2], (CoverClass{3, "Wald", {{1, 255, 3}}}));
}

TEST_F(Cover, WhatStandsBesideAndIsBrokenIsLeftOut) {
  const std::string path = raster("a", 2, [](int, int) { return 1; });
  for (const std::string of_band : {"<CategoryNames><Category>", "</x>", "<CategoryNames/>",
                                    "<GDALRasterAttributeTable><Row index=\"9\"/>"}) {
    say_beside(path, of_band);
    const auto opened = LandCover::open(path);
    ASSERT_TRUE(opened) << opened.error().what;
    EXPECT_EQ((*opened)->classes()[0].name, "");
  }
}

TEST_F(Cover, TheFingerprintIsOfClassesNamesAndPlaces) {
  const auto print = [&](const std::string& path) {
    return (*LandCover::open(path))->fingerprint();
  };
  const auto same = [](int c, int) { return c % 2; };
  const std::string a = print(raster("a", 4, same));
  EXPECT_EQ(print(raster("b", 4, same)), a);
  EXPECT_NE(print(raster("c", 4, [](int c, int) { return (c + 1) % 2; })), a);
  EXPECT_NE(print(raster("d", 4, [](int c, int) { return 2 * (c % 2); })), a);
  EXPECT_NE(print(raster("e", 5, same)), a);
  const std::string named = raster("f", 4, same);
  say_beside(named, "<CategoryNames><Category>Rock</Category></CategoryNames>");
  EXPECT_NE(print(named), a);
}

TEST_F(Cover, MeasuresAreNoClasses) {
  EXPECT_THAT(refusal(raster("many", 20, [](int c, int r) { return 100 + 20 * r + c; })),
              HasSubstr("255"));
  EXPECT_THAT(refusal(raster("low", 2, [](int c, int) { return -c; })), HasSubstr("nodata"));
  EXPECT_THAT(refusal(raster("empty", 2, [](int, int) { return kNone; })), HasSubstr("class"));
  const std::string nowhere = raster("nowhere", 2, [](int, int) { return 1; });
  std::filesystem::remove(folder_.file("nowhere.prj"));
  refusal(nowhere);
  refusal(folder_.file("there is none.tif"), Errc::not_found);
}

}  // namespace
}  // namespace tind
