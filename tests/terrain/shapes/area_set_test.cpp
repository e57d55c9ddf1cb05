#include "terrain/shapes/area_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "terrain/raster/dem_source.h"
#include "terrain/shapes/post_areas.h"
#include "tests/support/support.h"

namespace tind {
namespace {

std::vector<AreaSet::Edge> ring(std::uint32_t polygon, std::vector<Vec2> points) {
  std::vector<AreaSet::Edge> edges;
  for (std::size_t i = 0; i < points.size(); ++i)
    edges.push_back({points[i], points[(i + 1) % points.size()], polygon});
  return edges;
}

AreaSet of(std::initializer_list<std::vector<AreaSet::Edge>> rings) {
  std::vector<AreaSet::Edge> all;
  for (const auto& r : rings) all.insert(all.end(), r.begin(), r.end());
  return AreaSet(std::move(all));
}

TEST(AreaSet, holds_what_an_odd_number_of_edges_surrounds) {
  const AreaSet areas = of({ring(0, {{0, 0}, {10, 0}, {10, 10}, {0, 10}}),
                            ring(0, {{4, 4}, {6, 4}, {6, 6}, {4, 6}}),        // a hole
                            ring(1, {{5, -5}, {20, -5}, {20, 1}, {5, 1}})});  // over a part of it
  EXPECT_EQ(areas.holding(1, 1), 0u);
  EXPECT_EQ(areas.holding(5, 5), AreaSet::kNone);
  EXPECT_EQ(areas.holding(15, 0), 1u);
  EXPECT_EQ(areas.holding(6, 0.5), 0u);  // in both: the lower number
  EXPECT_EQ(areas.holding(-1, 5), AreaSet::kNone);
  EXPECT_EQ(areas.holding(1, 11), AreaSet::kNone);
  EXPECT_EQ(areas.holding(std::nan(""), 5), AreaSet::kNone);
  std::vector<std::uint32_t> both;
  areas.all_holding(6, 0.5, both);
  EXPECT_EQ(both, (std::vector<std::uint32_t>{0, 1}));
}

TEST(AreaSet, a_place_on_an_outline_is_on_one_side) {
  // Two squares side by side: each place of the line between them is in exactly one.
  const AreaSet areas =
      of({ring(0, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}), ring(1, {{1, 0}, {2, 0}, {2, 1}, {1, 1}})});
  std::vector<std::uint32_t> in;
  for (const double lat : {0.0, 0.25, 0.5, 0.999}) {
    areas.all_holding(1, lat, in);
    EXPECT_EQ(in.size(), 1u) << lat;
  }
  areas.all_holding(0.5, 1, in);
  EXPECT_TRUE(in.empty());  // the northern end is not theirs
}

TEST(AreaRow, answers_as_the_set_does_where_polygons_lie_on_each_other) {
  const std::string file = test::testdata("rainier.tif");
  const auto dem = DemSource::open({&file, 1});
  ASSERT_TRUE(dem && (*dem)->is_plain_geographic());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<AreaSet::Edge> edges;
  std::vector<Vec2> points;
  for (std::uint32_t p = 0; p < 60; ++p) {
    if (p % 3 != 1) {  // else the same once more
      points.clear();
      for (int k = 0; k < 4; ++k) points.push_back({unit(random), unit(random)});
    }
    for (const AreaSet::Edge& e : ring(p, points)) edges.push_back(e);
  }
  const AreaSet areas(std::move(edges));
  AreaRow row(areas, **dem);
  std::size_t held = 0;
  for (int j = 0; j < 200; ++j) {
    const double lat = unit(random);
    for (int i = 0; i < 100; ++i) {
      const double lon = i % 10 ? i / 100.0 : unit(random);  // back and forth
      const std::uint32_t polygon = areas.holding(lon, lat);
      ASSERT_EQ(row.holding(lon, lat), polygon) << lon << " " << lat;
      held += polygon != AreaSet::kNone;
    }
  }
  EXPECT_GT(held, 10'000u);
}

TEST(AreaSet, spans_are_what_holding_says) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<AreaSet::Edge> edges;
  for (std::uint32_t p = 0; p < 40; ++p) {
    std::vector<Vec2> star;  // crosses itself
    for (int k = 0; k < 7; ++k) star.push_back({unit(random), unit(random)});
    const auto r = ring(p, star);
    edges.insert(edges.end(), r.begin(), r.end());
  }
  const AreaSet areas(std::move(edges));
  std::vector<AreaSet::Span> spans;
  for (int k = 0; k < 500; ++k) {
    const double lon = unit(random), lat = unit(random);
    areas.spans(lat, spans);
    std::uint32_t first = AreaSet::kNone;
    for (const auto& s : spans)
      if (s.west <= lon && lon < s.east) first = std::min(first, s.polygon);
    EXPECT_EQ(areas.holding(lon, lat), first);
  }
}

TEST(AreaSet, says_whether_an_edge_touches_a_rectangle) {
  const AreaSet areas = of({ring(0, {{0, 0}, {10, 0}, {10, 10}, {0, 10}})});
  EXPECT_TRUE(areas.crosses({9, 9, 11, 11}));
  EXPECT_TRUE(areas.crosses({-1, -1, 11, 11}));
  EXPECT_TRUE(areas.crosses({4, -1, 5, 1}));
  EXPECT_FALSE(areas.crosses({4, 4, 5, 5}));    // inside
  EXPECT_FALSE(areas.crosses({11, 4, 12, 5}));  // outside
}

TEST(AreaSet, of_nothing_holds_nothing) {
  const AreaSet none;
  EXPECT_EQ(none.holding(0, 0), AreaSet::kNone);
  EXPECT_FALSE(none.crosses({-180, -90, 180, 90}));
  const AreaSet unknown({{{std::nan(""), 0}, {1, 1}, 0}});
  EXPECT_TRUE(unknown.empty());
}

}  // namespace
}  // namespace tind
