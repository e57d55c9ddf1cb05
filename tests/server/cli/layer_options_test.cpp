// What is said of one layer, and what cannot be said of several at once.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::run_tind;

class LayerOptions : public testing::Test {
 protected:
  /// 9 x 9 posts of 100 m, coarse ones and fine ones within.
  LayerOptions() {
    raster("coarse", 0.004);
    raster("fine", 0.001);
  }
  void raster(const std::string& name, double cell) const {
    std::ofstream out(folder.file(name + ".asc"));
    out << "ncols 9\nnrows 9\nxllcenter 7\nyllcenter 46\ncellsize " << cell
        << "\nNODATA_value -9999\n";
    for (int i = 0; i < 81; ++i) out << "100 ";
  }
  test::Ran height(const std::string& more) const {
    const std::string tiles = folder.file("tiles");
    const auto built = run_tind("build --force -o " + tiles + " --levels 0-13 " + more);
    if (built.code != 0) return built;
    return run_tind("elevation --tiles " + tiles + " --level 13 --at 7.004,46.004");
  }
  /// "7.004,46.004: 100.000 m above ..."
  static double metres(const test::Ran& ran) {
    const auto colon = ran.answer.find(": ");
    return colon == ran.answer.npos ? HUGE_VAL : std::stod(ran.answer.substr(colon + 2));
  }
  std::string layers() const {
    return " --layer low=" + folder.file("coarse.asc") +
           " --layer high=" + folder.file("fine.asc") + " --layer-option low=crs:EPSG:4326";
  }
  test::TempDir folder;
};

TEST_F(LayerOptions, OneDatumForFilesThatSayTheirsAndFilesThatDoNotIsRefused) {
  const std::string said = layers() + " --layer-option high=crs:EPSG:4979";
  const auto both = height(said + " --from-datum egm96");
  EXPECT_EQ(both.code, 2) << both.out;
  EXPECT_NE(both.out.find("say it of single layers"), std::string::npos) << both.out;
  // The fine layer is above the ellipsoid as it says, and 50 m below the coarse one's datum.
  const auto each = height(said + " --layer-option low=from-datum:egm96");
  EXPECT_EQ(each.code, 0) << each.out;
  EXPECT_NEAR(metres(each), 100, 0.5) << each.out;
}

TEST_F(LayerOptions, WhatAllSayMayBeOverruledForAll) {
  const std::string said = " --layer low=" + folder.file("coarse.asc") +
                           " --layer high=" + folder.file("fine.asc") +
                           " --crs EPSG:4979 --from-datum egm96";
  const auto both = height(said);
  EXPECT_EQ(both.code, 0) << both.out;
  EXPECT_GT(metres(both), 140) << both.out;
}

TEST_F(LayerOptions, WhatIsWrongIsSaid) {
  const auto refused = [&](const std::string& option, const std::string& why) {
    const auto ran = height(layers() + " --layer-option " + option);
    EXPECT_EQ(ran.code, 2) << ran.out;
    EXPECT_NE(ran.out.find(why), std::string::npos) << ran.out;
  };
  refused("high", "takes NAME=OPTION:VALUE");
  refused("middle=nodata:5", "there is no --layer 'middle'");
  refused("high=nodate:5", "no option of that name");
  refused("high=from-datum:sea", "sea");
}

}  // namespace
}  // namespace tind
