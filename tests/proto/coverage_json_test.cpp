#include "proto/coverage_json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace tind::proto {
namespace {

using Json = nlohmann::json;

CoverageJson coverage_of(std::span<const double> values) {
  CoverageJson c;
  c.crs = "http://www.opengis.net/def/crs/EPSG/0/4326";
  c.east_first = false;
  c.parameter.name = "a \"height\"";
  c.values = values;
  return c;
}

TEST(CoverageJson, a_grid_has_axes_in_steps_and_rows_of_x) {
  const std::vector<double> values = {1,    0.1, std::numeric_limits<double>::quiet_NaN(),
                                      1e-7, -5,  1e20};
  CoverageJson c = coverage_of(values);
  c.x = {7, 9, 3};
  c.y = {46, 46, 2};
  const Json json = Json::parse(encode_coverage_json(c));
  EXPECT_EQ(json["type"], "Coverage");
  EXPECT_EQ(json["domain"]["domainType"], "Grid");
  EXPECT_EQ(json["domain"]["axes"]["x"], Json::parse(R"({"start": 7, "stop": 9, "num": 3})"));
  EXPECT_EQ(json["domain"]["referencing"][0]["coordinates"], Json::parse(R"(["y", "x"])"));
  const Json& range = json["ranges"]["a \"height\""];
  EXPECT_EQ(range["axisNames"], Json::parse(R"(["y", "x"])"));
  EXPECT_EQ(range["shape"], Json::parse("[2, 3]"));
  for (std::size_t i = 0; i < values.size(); ++i)
    if (i == 2)
      EXPECT_TRUE(range["values"][i].is_null());
    else
      EXPECT_EQ(range["values"][i].get<double>(), values[i]) << "to the last bit";
  EXPECT_TRUE(json["parameters"].contains("a \"height\""));
  EXPECT_FALSE(json.contains("tind:max_error_m"));
}

TEST(CoverageJson, one_place_is_a_point_and_more_are_a_list) {
  const std::vector<double> values = {3, 4};
  CoverageJson c = coverage_of(std::span(values).first(1));
  c.places = {{7, 46}};
  c.point = true;
  const Json point = Json::parse(encode_coverage_json(c));
  EXPECT_EQ(point["domain"]["domainType"], "Point");
  EXPECT_EQ(point["domain"]["axes"],
            Json::parse(R"({"x": {"values": [7]}, "y": {"values": [46]}})"));
  EXPECT_FALSE(point["ranges"].begin()->contains("shape"));
  c = coverage_of(values);
  c.places = {{7, 46}, {8, 47}};
  c.max_error_m = 2.5;
  const Json many = Json::parse(encode_coverage_json(c));
  EXPECT_EQ(many["domain"]["domainType"], "MultiPoint");
  EXPECT_EQ(many["domain"]["axes"]["composite"]["values"], Json::parse("[[7, 46], [8, 47]]"));
  EXPECT_EQ((*many["ranges"].begin())["shape"], Json::parse("[2]"));
  EXPECT_EQ(many["tind:max_error_m"], 2.5);
}

}  // namespace
}  // namespace tind::proto
