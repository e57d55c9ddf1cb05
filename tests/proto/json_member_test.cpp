#include "proto/json_member.h"

#include <gtest/gtest.h>

namespace tind::json {
namespace {

using Json = nlohmann::json;

const Json kObject = {{"half", 0.5}, {"three", 3},      {"minus", -3},
                      {"name", "a"}, {"none", nullptr}, {"huge", 18446744073709551615u}};

TEST(JsonMember, is_null_where_there_is_none) {
  EXPECT_EQ(member(kObject, "three"), &kObject["three"]);
  EXPECT_EQ(member(kObject, "other"), nullptr);
  EXPECT_EQ(member(Json(3), "three"), nullptr);
  EXPECT_EQ(member(Json::array({3}), "three"), nullptr);
}

TEST(JsonMember, numbers_are_numbers_in_their_range) {
  EXPECT_EQ(number(kObject, "half"), 0.5);
  EXPECT_EQ(number(kObject, "three"), 3.0);
  EXPECT_EQ(number(kObject, "three", 3, 3), 3.0);
  EXPECT_FALSE(number(kObject, "three", 3.1, 4));
  EXPECT_FALSE(number(kObject, "three", 2, 2.9));
  for (const char* other : {"name", "none", "other"}) EXPECT_FALSE(number(kObject, other)) << other;
}

TEST(JsonMember, whole_numbers_have_no_point_and_do_not_wrap) {
  EXPECT_EQ(whole(kObject, "minus"), -3);
  EXPECT_EQ(whole(kObject, "three", 0, 3), 3);
  EXPECT_FALSE(whole(kObject, "three", 0, 2));
  EXPECT_FALSE(whole(kObject, "minus", 0, 3));
  EXPECT_FALSE(whole(kObject, "half"));
  EXPECT_FALSE(as_whole(Json(3.0)));
  EXPECT_FALSE(whole(kObject, "huge")) << "beyond 63 bits";
}

TEST(JsonMember, texts_are_strings) {
  EXPECT_EQ(text(kObject, "name"), "a");
  for (const char* other : {"three", "none", "other"}) EXPECT_FALSE(text(kObject, other)) << other;
}

}  // namespace
}  // namespace tind::json
