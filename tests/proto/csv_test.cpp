#include "proto/csv.h"

#include <gtest/gtest.h>

namespace tind::csv {
namespace {

TEST(Csv, FieldsStandBetweenCommasAndQuotes) {
  using Fields = std::vector<std::string>;
  EXPECT_EQ(fields_of("a,b"), (Fields{"a", "b"}));
  EXPECT_EQ(fields_of(""), (Fields{""}));
  EXPECT_EQ(fields_of("a,,"), (Fields{"a", "", ""}));
  EXPECT_EQ(fields_of(R"("a,b","say ""no""",c)"), (Fields{"a,b", R"(say "no")", "c"}));
  EXPECT_EQ(fields_of(R"("a)"), (Fields{"a"}));
}

TEST(Csv, FieldsAreQuotedWhereTheyHaveTo) {
  for (const std::string text : {"plain", "a, b", "say \"hm\"", ""})
    EXPECT_EQ(fields_of("1," + field(text) + ",2"), (std::vector<std::string>{"1", text, "2"}));
  EXPECT_EQ(field("plain"), "plain");
}

TEST(Csv, NumbersAreAllOfTheirField) {
  EXPECT_EQ(number(" 1.5e2\t"), 150);
  EXPECT_EQ(number("-7"), -7);
  for (const char* none : {"", "  ", "1 2", "1m", "nan", "inf", "0x1"})
    EXPECT_FALSE(number(none)) << none;
}

TEST(Csv, ColumnsOfPlacesHaveManyNames) {
  const auto found = PlaceColumns::in("name, Latitude ,LON", true);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->x, 2u);
  EXPECT_EQ(found->y, 1u);
  EXPECT_TRUE(PlaceColumns::in("easting,northing", true));
  EXPECT_FALSE(PlaceColumns::in("lon,lon", true));
  EXPECT_FALSE(PlaceColumns::in("1,2", true));
  EXPECT_FALSE(PlaceColumns::in("lon,y", true)) << "of two kinds";
  EXPECT_TRUE(PlaceColumns::in("lon,lat", false));
  const char* const both = "id,x,y,lon,lat";
  EXPECT_EQ(PlaceColumns::in(both, true)->x, 3u);
  EXPECT_EQ(PlaceColumns::in(both, true)->y, 4u);
  EXPECT_EQ(PlaceColumns::in(both, false)->x, 1u);
}

TEST(Csv, ALineSaysItsPlaceAndHowManyFieldsItHas) {
  const auto columns = PlaceColumns::in("name,lat,lon,,\"a,b\"", true);
  ASSERT_TRUE(columns);
  EXPECT_EQ(columns->count, 5u);
  const PlaceFields whole = columns->of("\"peak, the\",46.85, -121.76,,");
  EXPECT_EQ(whole.x, -121.76);
  EXPECT_EQ(whole.y, 46.85);
  EXPECT_EQ(whole.count, 5u);
  const PlaceFields brief = columns->of("far,high");
  EXPECT_FALSE(brief.x || brief.y);
  EXPECT_EQ(brief.count, 2u);
  EXPECT_EQ(columns->of("").count, 1u);
  EXPECT_EQ(columns->of(std::string(1000, ',')).count, 1001u);
}

TEST(Csv, ACoordinateIsNotThereTwice) {
  for (const char* head : {"lon,lat,lon", "lon,lat,longitude", "lat,lon,LAT", "x,y,lon", "x,y,lat",
                           "lon,lat,x", "lon,y,lat", "x,y,x", "e,n,easting", "lon,lat,n,northing",
                           "lon,lat,easting", "lat,lon,latitude,longitude"})
    for (const bool degrees : {true, false})
      EXPECT_FALSE(PlaceColumns::in(head, degrees)) << head << degrees;
  const std::string why = PlaceColumns::in("id,Longitude,lat,lon", true).error().what;
  EXPECT_NE(why.find("as longitude and as lon:"), std::string::npos) << why;
  for (const char* head : {"x,y,lon,lat", "lat,y,lon,x", "easting,northing,lon,lat", "e,n,x,y",
                           "e,n,x,y,lon,lat", "lon,lat,n", "e,lat,lon", "lon,lat,name,name,,",
                           "n,lat,lon,easting,northing", "easting,northing,n"})
    for (const bool degrees : {true, false})
      EXPECT_TRUE(PlaceColumns::in(head, degrees)) << head << degrees;
  EXPECT_EQ(PlaceColumns::in("e,n,x,y", true)->x, 2u) << "x and y before easting and northing";
  EXPECT_EQ(PlaceColumns::in("lon,lat,e,n", false)->y, 3u);
  EXPECT_EQ(PlaceColumns::in("easting,northing,n", false)->y, 1u);
  EXPECT_EQ(PlaceColumns::in("x,y,lon,lat,lng", false)->x, 0u) << "of what is not asked for";
  EXPECT_FALSE(PlaceColumns::in("x,y,lon,lat,lng", true));
}

TEST(Csv, NoColumnIsThereTwice) {
  EXPECT_EQ(why_no_columns("id,lon,lat", "height_m,coverage"), "");
  EXPECT_EQ(why_no_columns("id,lon,lat,\"coverage\"", "height_m,coverage"),
            "has a column coverage already: rename it, or leave it out");
}

}  // namespace
}  // namespace tind::csv
