// Colours of an image at places: as light, coarse ones as means of light, nothing where it is not.

#include "terrain/raster/image_colours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/support/globe_raster.h"
#include "tests/support/support.h"

namespace tind {
namespace {

constexpr const char* kWgs84 =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
    R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";

class Image : public ::testing::Test {
 protected:
  test::TempDir folder_;

  /// Grey of 16 bits, of pixels of 0.01 degrees from 7, 46 on to the east and the south; -1 is no
  /// data. `type`: as headers of BIL say it.
  std::string image(const std::string& name, int side, const std::function<double(int, int)>& grey,
                    const std::string& type = "UNSIGNEDINT") {
    constexpr int kNone = 77;
    std::ofstream(folder_.file(name + ".prj")) << kWgs84;
    std::ofstream(folder_.file(name + ".hdr"))
        << "BYTEORDER I\nLAYOUT BIL\nNROWS " << side << "\nNCOLS " << side
        << "\nNBANDS 1\nNBITS 16\nPIXELTYPE " << type << "\nNODATA " << kNone
        << "\nULXMAP 7.005\nULYMAP 45.995\nXDIM 0.01\nYDIM 0.01\n";
    std::ofstream out(folder_.file(name + ".bil"), std::ios::binary);
    for (int r = 0; r < side; ++r)
      for (int c = 0; c < side; ++c) {
        const double v = grey(c, r);
        const int value = v < 0 ? kNone : int(std::lround(v * 65535));
        out << char(value & 255) << char(value >> 8);
      }
    return folder_.file(name + ".bil");
  }
  static std::optional<ImageColours::Linear> one(const ImageColours& image, Geographic place,
                                                 double pixel_m) {
    std::optional<ImageColours::Linear> out;
    image.at({&place, 1}, pixel_m, {&out, 1});
    return out;
  }
};

TEST_F(Image, ThatShowsNothingIsNone) {
  const auto opened = ImageColours::open(image("none", 4, [](int, int) { return -1; }));
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().what.find("it shows nothing"), std::string::npos) << opened.error().what;
}

TEST_F(Image, OfTheGlobeHasColoursAllAround) {
  const auto opened = ImageColours::open(test::globe_raster(folder_, '\x80'));
  ASSERT_TRUE(opened) << opened.error().what;
  for (const double lon : test::kAroundTheGlobe) EXPECT_TRUE(one(**opened, {lon, 3}, 1)) << lon;
}

TEST_F(Image, FineIsThePixelAndCoarseTheMeanOfLight) {
  const auto opened =
      ImageColours::open(image("chess", 16, [](int c, int r) { return (c + r) % 2; }));
  ASSERT_TRUE(opened) << opened.error().what;
  const ImageColours& chess = **opened;
  for (const int c : {3, 4}) {
    const auto fine = one(chess, {7.005 + .01 * c, 45.995}, 1);
    ASSERT_TRUE(fine);
    EXPECT_NEAR((*fine)[0], c % 2, 1e-4);
  }
  const auto coarse = one(chess, {7.08, 45.92}, 5000);
  ASSERT_TRUE(coarse);
  for (const float channel : *coarse) EXPECT_NEAR(channel, .5, .005);  // as a picture it is .735
  EXPECT_FALSE(one(chess, {6.999, 45.95}, 1));
  EXPECT_FALSE(one(chess, {7.05, 45.83}, 1e6));
}

TEST_F(Image, HalfAsBrightInAPictureIsAFifthOfTheLight) {
  const auto opened = ImageColours::open(image("grey", 4, [](int, int) { return .5; }));
  ASSERT_TRUE(opened) << opened.error().what;
  EXPECT_NEAR((*one(**opened, {7.02, 45.98}, 1))[1], .2140, .004);
}

TEST_F(Image, NoDataIsNoColourAndDarkensNothing) {
  const auto opened =
      ImageColours::open(image("half", 8, [](int c, int) { return c < 4 ? -1 : 1; }));
  ASSERT_TRUE(opened) << opened.error().what;
  EXPECT_FALSE(one(**opened, {7.015, 45.96}, 1));
  EXPECT_EQ(one(**opened, {7.041, 45.96}, 1), (ImageColours::Linear{1, 1, 1}));
  EXPECT_EQ(one(**opened, {7.039, 45.96}, 1e5), (ImageColours::Linear{1, 1, 1}));
}

TEST_F(Image, TheFingerprintIsOfThePixelsAndTheirPlaces) {
  const auto grey = [](double v) { return [v](int, int) { return v; }; };
  const auto print = [&](const std::string& path) {
    return (*ImageColours::open(path))->fingerprint();
  };
  const std::string a = print(image("a", 4, grey(.5)));
  EXPECT_EQ(print(image("b", 4, grey(.5))), a);
  EXPECT_NE(print(image("c", 4, grey(.6))), a);
  EXPECT_NE(print(image("d", 5, grey(.5))), a);
}

TEST_F(Image, HeightsAreNoImage) {
  const auto grey = [](int, int) { return .2; };
  EXPECT_TRUE(ImageColours::open(image("grey", 4, grey)));
  const auto heights = ImageColours::open(image("heights", 4, grey, "SIGNEDINT"));
  ASSERT_FALSE(heights);
  EXPECT_EQ(heights.error().code, Errc::bad_data);
}

TEST_F(Image, WhatSaysNoPlaceIsRefused) {
  const std::string path = image("a", 4, [](int, int) { return .5; });
  std::filesystem::remove(folder_.file("a.prj"));
  const auto nowhere = ImageColours::open(path);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, Errc::bad_data);
  std::ofstream(folder_.file("x.png")) << "no image";
  EXPECT_FALSE(ImageColours::open(folder_.file("x.png")));
  EXPECT_FALSE(ImageColours::open(folder_.file("there is none.tif")));
}

}  // namespace
}  // namespace tind
