// Heights as images: pixels on posts are the posts, parents the means of their children, no seam,
// no pit, and another program's reading of the file gives the same heights.

#include "terrain/images/height_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "proto/image/height_colours.h"
#include "proto/image/image_file.h"
#include "terrain/base/file_io.h"
#include "terrain/surface/height_field.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using proto::HeightCode;
using test::MadeUpSource;

constexpr const char* kMercatorWkt =
    R"(PROJCS["WGS 84 / Pseudo-Mercator",GEOGCS["WGS 84",DATUM["WGS_1984",)"
    R"(SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
    R"(UNIT["degree",0.0174532925199433]],PROJECTION["Mercator_1SP"],)"
    R"(PARAMETER["central_meridian",0],PARAMETER["scale_factor",1],PARAMETER["false_easting",0],)"
    R"(PARAMETER["false_northing",0],UNIT["metre",1],AXIS["Easting",EAST],AXIS["Northing",NORTH],)"
    R"(EXTENSION["PROJ4","+proj=merc +a=6378137 +b=6378137 +lat_ts=0 +lon_0=0 +x_0=0 +y_0=0 +k=1 )"
    R"(+units=m +nadgrids=@null +wktext +no_defs"],AUTHORITY["EPSG","3857"]])";

double metres(double u) { return (u - .5) * web_mercator::kEarthM; }  // of EPSG:3857

/// Posts at the centres of a tile's pixels, heights in whole tenths.
class OnPixels : public ::testing::Test {
 protected:
  static constexpr int kPosts = 40, kFirst = 100;  // of the tile's pixels
  static double height(int c, int r) { return 1000 + (c * 131 + r * 37) % 509 * .1; }

  OnPixels() {
    const double pixel = web_mercator::kEarthM / std::ldexp(1.0, tile_.level) / kImagePixels;
    const double west = metres(tile_.x / std::ldexp(1.0, tile_.level)) + kFirst * pixel;
    const double north = -metres(tile_.y / std::ldexp(1.0, tile_.level)) - kFirst * pixel;
    std::ofstream(folder_.file("d.prj")) << kMercatorWkt;
    std::ofstream out(folder_.file("d.asc"));
    out.precision(17);
    out << "ncols " << kPosts << "\nnrows " << kPosts << "\nxllcorner " << west << "\nyllcorner "
        << north - kPosts * pixel << "\ncellsize " << pixel << "\nNODATA_value -9999\n";
    for (int r = 0; r < kPosts; ++r)
      for (int c = 0; c < kPosts; ++c) out << height(c, r) << (c + 1 < kPosts ? ' ' : '\n');
    out.close();
    auto opened = DemSource::open(std::vector<std::string>{folder_.file("d.asc")});
    if (!opened) throw std::runtime_error(opened.error().what);
    source_ = *opened;
  }

  test::TempDir folder_;
  web_mercator::Tile tile_ = *web_mercator::tile(12, 2130, 1450);
  std::shared_ptr<const DemSource> source_;
};

TEST_F(OnPixels, APixelOnAPostIsThePost) {
  EXPECT_EQ(deepest_image_level(source_), tile_.level);
  const auto image = height_image(source_, tile_);
  ASSERT_TRUE(image) << image.error().what;
  EXPECT_EQ(image->samples, 1);
  EXPECT_EQ(image->max_deviation_m, 0);
  EXPECT_NEAR(image->filled_share, 1 - kPosts * kPosts / std::pow(kImagePixels, 2), 1e-3);
  for (const HeightCode code : {HeightCode::mapbox, HeightCode::terrarium})
    for (int r = 1; r + 1 < kPosts; ++r)
      for (int c = 1; c + 1 < kPosts; ++c) {
        const float at = image->heights[std::size_t(kFirst + r) * kImagePixels + kFirst + c];
        EXPECT_NEAR(proto::height_of(proto::height_colour(at, code), code), height(c, r),
                    proto::height_step_m(code) / 2 + 1e-3);
      }
}

TEST_F(OnPixels, AnotherReaderOfTheFileGetsTheSameHeights) {
  const auto image = height_image(source_, tile_);
  ASSERT_TRUE(image) << image.error().what;
  for (const HeightCode code : {HeightCode::mapbox, HeightCode::terrarium}) {
    const std::string path = folder_.file(std::string(proto::name(code)) + ".png");
    ASSERT_TRUE(write_whole_file(
        path, proto::encode_image({.width = kImagePixels,
                                   .height = kImagePixels,
                                   .channels = 3,
                                   .samples = proto::height_colours(image->heights, code),
                                   .texts = {{"Key", "text"}}},
                                  proto::ImageFormat::png)));
    std::ofstream(folder_.file(std::string(proto::name(code)) + ".pgw")) << "1\n0\n0\n-1\n0\n0\n";
    const auto read = DemSource::open(
        std::vector{path}, {.encoding = code == HeightCode::mapbox ? HeightEncoding::mapbox
                                                                   : HeightEncoding::terrarium});
    ASSERT_TRUE(read) << read.error().what;
    const auto grid = (*read)->read(0, 0, kImagePixels, kImagePixels);
    ASSERT_TRUE(grid) << grid.error().what;
    for (int r = 0; r < kImagePixels; ++r)
      for (int c = 0; c < kImagePixels; ++c)
        ASSERT_NEAR(grid->at(c, r), image->heights[std::size_t(r) * kImagePixels + c],
                    proto::height_step_m(code) / 2 + 1e-3)
            << c << " " << r;
  }
}

/// Of 2 x 2 pixels of the children, which ask H where the parent does.
TEST(HeightImages, AParentsPixelIsTheMeanOfItsChildren) {
  const Surface surface = std::make_shared<MadeUpSource>(test::rough_terrain(300, 300, 3, 400),
                                                         Geographic{7.01, 46.3}, .0005);
  const int deepest = deepest_image_level(surface) + 3;  // of tiles of an eighth of the pixels
  const auto at = [&](int level) {
    const double side = std::ldexp(1.0, level);
    return *web_mercator::tile(level, std::int64_t(web_mercator::u_of(7.08) * side),
                               std::int64_t(web_mercator::v_of(46.23) * side));
  };
  const web_mercator::Tile parent = at(deepest - 1);
  const auto whole = height_image(surface, parent, 64);
  ASSERT_TRUE(whole);
  for (int q = 0; q < 4; ++q) {
    const auto child = *web_mercator::tile(deepest, parent.x * 2 + q % 2, parent.y * 2 + q / 2);
    const auto part = height_image(surface, child, 64);
    ASSERT_TRUE(part);
    ASSERT_EQ(whole->samples, 2 * part->samples);
    if (part->filled_share > 0 || whole->filled_share > 0) continue;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) {
        double sum = 0;
        for (int k = 0; k < 4; ++k)
          sum += part->heights[std::size_t(2 * y + k / 2) * 64 + 2 * x + k % 2];
        EXPECT_NEAR(whole->heights[std::size_t(y + q / 2 * 32) * 64 + x + q % 2 * 32], sum / 4,
                    1e-3);
      }
  }
}

TEST(HeightImages, VoidsAreNoPitsAndSamplesTellHowFarTheyAre) {
  HeightGrid grid = test::terrain_with_voids(120, 120, 5);
  for (int r = 0; r < grid.rows(); ++r)
    for (float& h : grid.row(r)) h += 3000;
  const Surface surface = std::make_shared<MadeUpSource>(grid, Geographic{7.01, 46.3}, .001);
  const int level = deepest_image_level(surface) - 1;
  const double side = std::ldexp(1.0, level);
  const auto tile = *web_mercator::tile(level, std::int64_t(web_mercator::u_of(7.06) * side),
                                        std::int64_t(web_mercator::v_of(46.25) * side));
  const auto image = height_image(surface, tile);
  ASSERT_TRUE(image);
  EXPECT_GT(image->samples, 1);
  EXPECT_GT(image->max_deviation_m, 0);
  EXPECT_GT(image->filled_share, 0);
  const GeoRect& bounds = surface.info().bounds;
  int inside = 0;
  for (int y = 0; y < kImagePixels; ++y)
    for (int x = 0; x < kImagePixels; ++x) {
      const float h = image->heights[std::size_t(y) * kImagePixels + x];
      ASSERT_TRUE(std::isfinite(h));
      if (!bounds.contains({web_mercator::lon_of((tile.x + (x + .5) / kImagePixels) / side),
                            web_mercator::lat_of((tile.y + (y + .5) / kImagePixels) / side)}))
        continue;
      ASSERT_GT(h, 1000);
      ++inside;
    }
  EXPECT_GT(inside, 1000);
}

TEST(HeightImages, ExistWhereTheSourceIs) {
  const Surface surface =
      std::make_shared<MadeUpSource>(test::rough_terrain(50, 50, 1), Geographic{7.01, 46.3}, .001);
  const int deepest = deepest_image_level(surface);
  EXPECT_TRUE(has_image(surface, *web_mercator::tile(0, 0, 0)));
  EXPECT_TRUE(has_image(surface, *web_mercator::tile(1, 1, 0)));
  EXPECT_FALSE(has_image(surface, *web_mercator::tile(1, 1, 1)));
  EXPECT_FALSE(has_image(surface, *web_mercator::tile(1, 0, 0)));
  const double side = std::ldexp(1.0, deepest + 1);
  EXPECT_FALSE(has_image(
      surface, *web_mercator::tile(deepest + 1, std::int64_t(web_mercator::u_of(7.02) * side),
                                   std::int64_t(web_mercator::v_of(46.29) * side))));
  for (const auto& [z, x, y] : {std::tuple{-1, 0, 0}, {23, 0, 0}, {2, 4, 0}, {2, 0, -1}})
    EXPECT_FALSE(web_mercator::tile(z, x, y));
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_EQ(
      height_image(surface, *web_mercator::tile(0, 0, 0), 64, stopped.get_token()).error().code,
      Errc::cancelled);
}

}  // namespace
}  // namespace tind
