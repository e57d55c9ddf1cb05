// Sets of tiles against a plain set of numbers.

#include "terrain/geo/availability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace tind {
namespace {

using Places = std::set<std::pair<std::uint32_t, std::uint32_t>>;

Places places_of(std::span<const TileRange> ranges) {
  Places places;
  for (const TileRange& r : ranges)
    for (std::uint32_t x = r.west; x <= r.east; ++x)
      for (std::uint32_t y = r.south; y <= r.north; ++y) places.emplace(x, y);
  return places;
}

void expect_is(const TileArea& area, const Places& wanted) {
  std::uint64_t count = 0;
  for (const TileRange& r : area.ranges()) count += r.size();
  EXPECT_EQ(count, wanted.size());  // none twice
  EXPECT_EQ(area.size(), wanted.size());
  EXPECT_EQ(places_of(area.ranges()), wanted);
  for (std::uint32_t x = 0; x < 16; ++x)
    for (std::uint32_t y = 0; y < 16; ++y)
      EXPECT_EQ(area.contains(x, y), wanted.contains({x, y})) << x << " " << y;
  Places numbered;
  for (std::uint64_t i = 0; i < area.size(); ++i) {
    numbered.insert(area[i]);
    EXPECT_GE(area.ranges().front().north, area[i].second);
  }
  EXPECT_EQ(numbered, wanted);
}

TEST(TileArea, is_what_its_rectangles_cover) {
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    std::vector<TileRange> ranges;
    for (unsigned n = random() % 9; n > 0; --n) {
      const std::uint32_t x = random() % 16, y = random() % 16;
      ranges.push_back(
          {x, y, x + std::uint32_t(random()) % (16 - x), y + std::uint32_t(random()) % (16 - y)});
      if (round % 2) ranges.back().east = x + (ranges.back().east - x) % 3;
    }
    const TileArea area(ranges);
    expect_is(area, places_of(ranges));
    // One form, whatever it was made of.
    std::vector<TileRange> shuffled(area.ranges().begin(), area.ranges().end());
    shuffled.insert(shuffled.end(), ranges.begin(), ranges.end());
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    EXPECT_TRUE(std::ranges::equal(TileArea(shuffled).ranges(), area.ranges()));
    const TileRange frame{3, 5, 11, 9};
    Places inside;
    for (const auto& [x, y] : places_of(ranges))
      if (x >= 3 && x <= 11 && y >= 5 && y <= 9) inside.emplace(x, y);
    EXPECT_EQ(places_of(area.within(frame)), inside);
  }
}

TEST(TileArea, touching_rectangles_become_one) {
  const TileArea area({{0, 0, 3, 1}, {4, 0, 7, 1}, {0, 2, 7, 5}});
  ASSERT_EQ(area.ranges().size(), 1u);
  EXPECT_EQ(area.ranges()[0], (TileRange{0, 0, 7, 5}));
}

TEST(TileArea, counts_from_the_north_as_rasters_lie) {
  const TileArea area({{2, 4, 3, 5}, {0, 0, 0, 0}});
  using Place = std::pair<std::uint32_t, std::uint32_t>;
  EXPECT_EQ(area[0], Place(2, 5));
  EXPECT_EQ(area[1], Place(3, 5));
  EXPECT_EQ(area[2], Place(2, 4));
  EXPECT_EQ(area[4], Place(0, 0));
}

TEST(TilesOver, hold_part_of_the_rectangle) {
  EXPECT_EQ(tiles_over({-180, -90, 180, 90}, 2), (TileRange{0, 0, 7, 3}));
  EXPECT_EQ(tiles_over({0, 0, 45, 45}, 2), (TileRange{4, 2, 4, 2}));
  EXPECT_EQ(tiles_over({45, 10, 45, 10}, 2), (TileRange{5, 2, 5, 2}));  // a point
  EXPECT_EQ(tiles_over({180, 90, 180, 90}, 2), (TileRange{7, 3, 7, 3}));
}

}  // namespace
}  // namespace tind
