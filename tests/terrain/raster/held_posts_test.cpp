#include "terrain/raster/held_posts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;
using testing::HasSubstr;

/// 3 x 2 posts 100 m apart in UTM zone 33, the first of them on its meridian.
HeldPosts posts_of(const std::string& drawing = "1 2 3 / 4 . 6",
                   const std::string& crs = "EPSG:32633") {
  return {"hill.ply", "TIN", grid_from(drawing), {500000, 100, 0, 5000000, 0, -100}, crs};
}

std::string refused(HeldPosts posts, const DemOptions& options = {}) {
  const auto dem = dem_of(std::move(posts), options);
  return dem ? "" : dem.error().what;
}

TEST(HeldPosts, AreADem) {
  const auto dem = dem_of(posts_of());
  ASSERT_TRUE(dem) << dem.error().what;
  const DemInfo& info = (*dem)->info();
  EXPECT_EQ(info.files, std::vector<std::string>{"hill.ply"});
  EXPECT_EQ(info.driver, "TIN");
  EXPECT_EQ(info.cols, 3);
  EXPECT_EQ(info.rows, 2);
  EXPECT_EQ(info.crs_kind, CrsKind::projected);
  EXPECT_EQ(info.datum, VerticalDatum::unknown);
  EXPECT_TRUE(info.warnings.empty());
  EXPECT_TRUE((*dem)->unchanged());

  const auto read = (*dem)->read(-1, 0, 5, 3);
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->is_void(0, 0));  // outside
  EXPECT_EQ(read->at(1, 0), 1);
  EXPECT_EQ(read->at(3, 1), 6);
  EXPECT_TRUE(read->is_void(2, 1));  // a void
  EXPECT_TRUE(read->is_void(1, 2));
  const auto every_second = (*dem)->read_decimated(0, 0, 2, 1, 2);
  ASSERT_TRUE(every_second);
  EXPECT_EQ(every_second->at(1, 0), 3);

  // The first post is on the meridian of the zone.
  const Vec2 at[] = {{0, 0}, {2, 1}};
  Geographic places[2];
  (*dem)->to_geographic(at, places);
  EXPECT_NEAR(places[0].lon, 15, 1e-9);
  Vec2 back[2];
  (*dem)->to_post(places, back);
  EXPECT_NEAR(back[1].x, 2, 1e-6);
  EXPECT_NEAR(back[1].y, 1, 1e-6);
}

TEST(HeldPosts, WhatTheUserSaysOfTheirCrsCounts) {
  const auto said = dem_of(posts_of("1 2 / 3 4", "EPSG:32633"), {.crs = "EPSG:32632"});
  ASSERT_TRUE(said);
  const Vec2 first{0, 0};
  Geographic place;
  (*said)->to_geographic({&first, 1}, {&place, 1});
  EXPECT_NEAR(place.lon, 9, 1e-9);
  ASSERT_EQ((*said)->info().warnings.size(), 1u);
  EXPECT_THAT((*said)->info().warnings[0], HasSubstr("hill.ply"));
  const auto none = dem_of(posts_of("1 2 / 3 4", ""));
  ASSERT_TRUE(none);
  EXPECT_EQ((*none)->info().crs_kind, CrsKind::none);
  EXPECT_EQ((*none)->info().spacing_x_m, 100);
  // Nobody need mind what the file says then.
  EXPECT_TRUE(dem_of(posts_of("1 2 / 3 4", "EPSG:1"), {.crs = "EPSG:32633"}));
}

TEST(HeldPosts, AreBroughtToAnotherDatumAsThoseOfRastersAre) {
  HeldPosts posts = posts_of("1 2 / 3 4");
  posts.datum = VerticalDatum::egm96;
  const auto dem =
      dem_of(posts, {.to_datum = TargetDatum::ellipsoid, .environment = test::environment()});
  ASSERT_TRUE(dem) << dem.error().what;
  EXPECT_EQ((*dem)->info().source_datum, VerticalDatum::egm96);
  EXPECT_EQ((*dem)->info().datum, VerticalDatum::ellipsoid);
  const auto egm96 = test::environment()->egm96();
  ASSERT_TRUE(egm96);
  const Vec2 at{1, 1};
  Geographic place;
  (*dem)->to_geographic({&at, 1}, {&place, 1});
  const auto read = (*dem)->read(1, 1, 1, 1);
  ASSERT_TRUE(read);
  EXPECT_NEAR(read->at(0, 0), 4 + (*egm96)->undulation(place), 1e-3);
  EXPECT_THAT(refused(posts_of(), {.to_datum = TargetDatum::ellipsoid}), HasSubstr("hill.ply"));
}

TEST(HeldPosts, OthersAreOthers) {
  const auto fingerprint = [](const HeldPosts& posts) {
    const auto dem = dem_of(posts);
    return dem ? (*dem)->info().fingerprint : "";
  };
  HeldPosts moved = posts_of();
  moved.post_to_crs.x0 += 1;
  EXPECT_EQ(fingerprint(posts_of()), fingerprint(posts_of()));
  EXPECT_NE(fingerprint(posts_of()), fingerprint(moved));
  EXPECT_NE(fingerprint(posts_of()), fingerprint(posts_of("1 2 3 / 4 . 7")));
  EXPECT_NE(fingerprint(posts_of()), fingerprint(posts_of("1 2 3 / 4 . 6", "EPSG:32632")));
}

TEST(HeldPosts, WhatCannotBeIsRefusedByName) {
  EXPECT_THAT(refused(posts_of("1 2 / 3 99999")), HasSubstr("hill.ply: a height of 99999 m"));
  EXPECT_THAT(refused(posts_of("1 2 / 3 4", "EPSG:1")), HasSubstr("--crs"));
  // A file of a mesh names no other file.
  EXPECT_THAT(refused(posts_of("1 2 / 3 4", "+proj=longlat +nadgrids=/etc/passwd")),
              HasSubstr("neither WKT nor"));
  // 500,000 degrees are no place.
  EXPECT_THAT(refused(posts_of("1 2 / 3 4", "EPSG:4326")), HasSubstr("lie outside of its CRS"));
}

}  // namespace
}  // namespace tind
