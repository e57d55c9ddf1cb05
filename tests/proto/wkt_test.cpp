#include "proto/wkt.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace tind::proto {
namespace {

TEST(Wkt, reads_what_clients_write) {
  for (const char* text : {"POINT(7.5 46)", "point ( 7.5  46 )", "POINT(7.5+46)",
                           "POINT Z (7.5 46 9)", "POINTZ(7.5 46 9)", "POINTM(7.5 46 9)",
                           "POINT ZM(7.5 46 1 2)", "POINT(+7.5 4.6e+1)", "POINT(75E-1 46)"}) {
    const auto g = decode_wkt(text, 1);
    ASSERT_TRUE(g) << text << ": " << g.error().what;
    EXPECT_EQ(g->type, WktType::point);
    ASSERT_EQ(g->parts.size(), 1u);
    EXPECT_EQ(g->parts[0][0], (WktLine{{7.5, 46}})) << text;
  }
  EXPECT_TRUE(decode_wkt("LINESTRINGZM(0 1 2 3,4 5 6 7)", 9)->has_m);
  EXPECT_TRUE(decode_wkt("LINESTRING Z(0 1 2,4 5 6)", 9)->has_z);
  EXPECT_FALSE(decode_wkt("LINESTRING M(0 1 2,4 5 6)", 9)->has_z);
}

TEST(Wkt, knows_parts_from_rings_from_lines) {
  EXPECT_EQ(decode_wkt("MULTIPOINT(1 2,3 4)", 9)->parts[0][0].size(), 2u);
  EXPECT_EQ(decode_wkt("MULTIPOINT((1 2),(3 4))", 9)->parts[0][0].size(), 2u);
  EXPECT_EQ(decode_wkt("MULTILINESTRING((1 2,3 4),(5 6,7 8,9 9))", 9)->parts[0].size(), 2u);
  const auto hole = decode_wkt("POLYGON((0 0,9 0,9 9,0 0),(1 1,2 1,2 2,1 1))", 9);
  EXPECT_EQ(hole->parts[0].size(), 2u);
  const auto two = decode_wkt(
      "MULTIPOLYGON(((0 0,9 0,9 9,0 0),(1 1,2 1,2 2,1 1)),((20 20,21 20,21 21,20 20)))", 12);
  ASSERT_TRUE(two);
  ASSERT_EQ(two->parts.size(), 2u);
  EXPECT_EQ(two->parts[0].size(), 2u);
  EXPECT_EQ(two->parts[1].size(), 1u);
}

TEST(Wkt, what_is_none_is_refused_and_says_where) {
  for (const char* text : {"",
                           "POINT",
                           "POINT EMPTY",
                           "POINT()",
                           "POINT(1)",
                           "POINT(1 2",
                           "POINT(1 2))",
                           "POINT(1 2 3)",
                           "POINT Z(1 2)",
                           "POINT(1 nan)",
                           "POINT(1 inf)",
                           "POINT(1 2,3 4)",
                           "POINT(a b)",
                           "1,2",
                           "LINESTRING(1 2)",
                           "LINESTRING((1 2,3 4))",
                           "LINESTRING(1 2;3 4)",
                           "LINESTRING(1 2,,3 4)",
                           "POLYGON((0 0,1 0,1 1))",
                           "POLYGON((0 0,1 0,1 1,0 1))",
                           "POLYGON(0 0,1 0,1 1,0 0)",
                           "MULTIPOLYGON((0 0,1 0,1 1,0 0))",
                           "GEOMETRYCOLLECTION(POINT(1 2))",
                           "CIRCULARSTRING(0 0,1 1,2 0)",
                           "POINTX(1 2)",
                           "POINTMZ(1 2 3 4)",
                           "POINT(1e999 2)",
                           "SRID=4326;POINT(1 2)"}) {
    const auto g = decode_wkt(text, 99);
    ASSERT_FALSE(g) << text;
    EXPECT_NE(g.error().what.find("at character"), std::string::npos) << text;
  }
  EXPECT_TRUE(decode_wkt("LINESTRING(1 2,3 4)", 2));
  EXPECT_FALSE(decode_wkt("LINESTRING(1 2,3 4,5 6)", 2)) << "more places than may be";
}

TEST(Wkt, any_change_of_a_text_is_read_or_refused) {
  const std::string sound = "MULTIPOLYGON Z(((0 0 1,9 0 1,9 9 1,0 0 1)))";
  std::mt19937 random(1);
  int read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = sound;
    for (int n = 0; n < 2; ++n) text[random() % text.size()] = "()., 0Z-e+x"[random() % 11];
    const auto g = decode_wkt(text, 3 + random() % 3);
    if (!g) continue;
    ++read;
    for (const auto& part : g->parts)
      for (const auto& line : part) EXPECT_FALSE(line.empty());
  }
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace tind::proto
