// What classes of land cover are drawn with: as somebody says, as schemes have it, by their names.

#include "terrain/flightgear/cover_materials.h"

#include <gtest/gtest.h>

#include "tests/terrain/flightgear/made_up_cover.h"

namespace tind::flightgear {
namespace {

TEST(CoverMaterials, LaterWordsWin) {
  const auto all = parse_materials("80=Ocean,worldcover,10=EvergreenForest,300=My-Own_1");
  ASSERT_TRUE(all) << all.error().what;
  EXPECT_EQ(all->at(80), "Lake");
  EXPECT_EQ(all->at(10), "EvergreenForest");
  EXPECT_EQ(all->at(300), "My-Own_1");
  EXPECT_EQ(all->count(11), 0u);
  EXPECT_TRUE(parse_materials("")->empty());
}

TEST(CoverMaterials, CorineHasCodesAndTheNumbersOfItsRasters) {
  const auto all = parse_materials("corine");
  ASSERT_TRUE(all) << all.error().what;
  EXPECT_EQ(all->size(), 2 * 44u);
  EXPECT_EQ(all->at(1), all->at(111));
  EXPECT_EQ(all->at(24), "EvergreenForest");
  EXPECT_EQ(all->at(312), "EvergreenForest");
  EXPECT_EQ(all->at(44), "Ocean");
  EXPECT_EQ(all->at(523), "Ocean");
}

TEST(CoverMaterials, WhatIsNoneIsRefused) {
  for (const char* text :
       {"forest", "10", "=Lake", "10=", "65536=Lake", "-1=Lake", "1.5=Lake", "10=A b", "10=../x",
        "10=L\xc3\xa4k", "10=Lake;20=Rock", " 10=Lake", "10=Lake,,20=Rock"}) {
    const auto all = parse_materials(text);
    ASSERT_FALSE(all) << text;
    EXPECT_EQ(all.error().code, Errc::invalid_argument);
  }
  EXPECT_FALSE(parse_materials("10=" + std::string(64, 'a')));
  EXPECT_TRUE(parse_materials("10=" + std::string(63, 'a')));
}

TEST(CoverMaterials, OfAClassThatIsNotNamedItsOwnNameCountsIfItIsLandOfFlightGears) {
  const auto cover = std::make_shared<test::MadeUpCover>(
      GeoRect{0, 0, 1, 1},
      std::vector<CoverClass>{{1, "Rock"}, {2, "Bare rock"}, {3, "Sand"}, {4, ""}});
  EXPECT_EQ(class_materials(*cover), (std::vector<std::string>{"Rock", "", "Sand", ""}));
  const auto said = with_materials(cover, {{3, "Littoral"}, {9, "Lake"}});
  EXPECT_EQ(class_materials(*said), (std::vector<std::string>{"Rock", "", "Littoral", ""}));
  EXPECT_NE(digest_of(*said), digest_of(*cover));
  EXPECT_EQ(digest_of(*said), digest_of(*with_materials(cover, {{3, "Littoral"}})));
  EXPECT_NE(digest_of(*cover),
            digest_of(test::MadeUpCover(cover->bounds(), cover->classes(), "x")));
  EXPECT_EQ(said->fingerprint(), cover->fingerprint());
  EXPECT_EQ(said->classes(), cover->classes());
}

}  // namespace
}  // namespace tind::flightgear
