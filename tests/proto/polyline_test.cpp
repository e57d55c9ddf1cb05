#include "proto/polyline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tind::proto {
namespace {

TEST(Polyline, the_example_of_its_description) {
  const std::vector<PolylinePlace> places = {{38.5, -120.2}, {40.7, -120.95}, {43.252, -126.453}};
  const std::string text = "_p~iF~ps|U_ulLnnqC_mqNvxq`@";
  EXPECT_EQ(encode_polyline(places, 5), text);
  EXPECT_EQ(decode_polyline(text, 5, 3), places);
}

TEST(Polyline, places_come_back_as_rounded) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> lat(-90, 90), lon(-180, 180);
  std::vector<PolylinePlace> places = {{90, 180}, {-90, -180}, {0, 0}, {-1e-5, 1e-5}};
  for (int i = 0; i < 500; ++i) places.push_back({lat(random), lon(random)});
  for (const int digits : {1, 5, 6, 7}) {
    const auto back = decode_polyline(encode_polyline(places, digits), digits, places.size());
    ASSERT_TRUE(back && back->size() == places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      EXPECT_NEAR((*back)[i].lat, places[i].lat, 0.5001 * std::pow(10, -digits));
      EXPECT_NEAR((*back)[i].lon, places[i].lon, 0.5001 * std::pow(10, -digits));
    }
  }
}

TEST(Polyline, what_is_none_is_refused) {
  const std::string text = "_p~iF~ps|U_ulLnnqC";
  EXPECT_FALSE(decode_polyline(text.substr(0, text.size() - 1), 5, 9));
  EXPECT_FALSE(decode_polyline("_p~iF", 5, 9));        // half a place
  EXPECT_FALSE(decode_polyline("_p~ iF~ps|U", 5, 9));  // a blank
  EXPECT_FALSE(decode_polyline(text, 5, 1));           // more than may be
  EXPECT_FALSE(decode_polyline("~~~~~~~~~~~~", 5, 9));
  std::string away;
  for (int i = 0; i < 12; ++i) away += encode_polyline(std::vector<PolylinePlace>{{90, 0}}, 5);
  EXPECT_FALSE(decode_polyline(away, 5, 99));  // the twelfth is at latitude 1080
  EXPECT_EQ(decode_polyline("", 5, 9)->size(), 0u);
}

}  // namespace
}  // namespace tind::proto
