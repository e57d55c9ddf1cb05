#include "proto/json_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace tind::json {
namespace {

using Json = nlohmann::ordered_json;

std::string nested(int depth) {
  return std::string(std::size_t(depth), '[') + std::string(std::size_t(depth), ']');
}

TEST(JsonText, TooDeepIsNoJson) {
  EXPECT_FALSE(parse<Json>(nested(kDeepest)).is_discarded());
  EXPECT_TRUE(parse<Json>(nested(kDeepest + 1)).is_discarded());
  EXPECT_TRUE(parse<nlohmann::json>(nested(1'000'000)).is_discarded());
  EXPECT_TRUE(parse<Json>("{\"a\":" + nested(kDeepest) + "}").is_discarded());
  // Brackets in strings do not count, nor do arrays beside each other.
  EXPECT_EQ(parse<Json>("[\"" + std::string(500, '[') + "\\\"[\"]").size(), 1u);
  std::string wide = "[[]";
  for (int i = 0; i < 500; ++i) wide += ",[{}]";
  EXPECT_EQ(parse<Json>(wide + "]").size(), 501u);
}

TEST(JsonText, NothingFollowsTheValue) {
  using namespace std::string_view_literals;
  EXPECT_FALSE(parse<Json>("{} \n").is_discarded());
  for (const std::string_view text : {"{} 1"sv, "{}\0"sv, "{}\0{\"a\": 1}"sv, "[1\0]"sv})
    EXPECT_TRUE(parse<Json>(text).is_discarded()) << text;
}

TEST(JsonText, ValuesAreCountedBeforeTheyAreBuilt) {
  for (const char* text :
       {"1", "[]", "{}", "[ ]", "[\"]\"]", "[\"[,\\\",\", 2]",
        "{\"a\": [], \"b\": {\"c\": [1, 2,\n3]}}", "[[[]], {}, \"\", [\"\"], {\"\": 0}, null]"})
    EXPECT_EQ(count_values(text), values_of(Json::parse(text))) << text;
  for (const char* text : {"", "]", "[,", "}{", "\""}) EXPECT_LE(count_values(text), 3u) << text;
}

std::string with_members(std::size_t count) {
  std::string text = "{";
  for (std::size_t i = 0; i < count; ++i)
    text += (i ? ",\"" : "\"") + std::to_string(i) + "\": [{}]";
  return text + "}";
}

TEST(JsonText, MembersAreCountedInTheLargestObject) {
  for (const auto& [text, most] :
       {std::pair{"1", 0u}, std::pair{"{}", 0u}, std::pair{R"(["a:b", {"c:\":": ":"}])", 1u},
        std::pair{R"({"a": {"b": 1, "c": [{"d": 1, "e": 2, "f": 3}]}, "g": {}})", 3u},
        std::pair{R"([{"a": {"b": {}}, "c": 1}, {"d": 1}])", 2u}, std::pair{"}:{\"", 0u}})
    EXPECT_EQ(most_members(text), most) << text;
  EXPECT_EQ(most_members("[" + with_members(50'000) + ",{\"a\": 1}]"), 50'000u);
}

TEST(JsonText, NoOrderIsKeptOfVeryManyMembers) {
  EXPECT_EQ(parse<Json>(with_members(kMostOrderedMembers)).size(), kMostOrderedMembers);
  for (const std::size_t count : {kMostOrderedMembers + 1, std::size_t(50'000)}) {
    EXPECT_TRUE(parse<Json>("[1," + with_members(count) + "]").is_discarded()) << count;
    EXPECT_EQ(parse<nlohmann::json>(with_members(count)).size(), count);
  }
  std::string many = with_members(kMostOrderedMembers);  // objects, on the other hand
  for (int i = 0; i < 3; ++i) many += "," + with_members(kMostOrderedMembers);
  EXPECT_EQ(parse<Json>("[" + many + "]").size(), 4u);
}

TEST(JsonText, ANameThatAnObjectHasTwiceIsFound) {
  for (const char* text : {R"({"a": 1, "a": 1})", R"([{"b": {"c": [{"x": 0, "a": {}, "a": 2}]}}])",
                           R"({"a": {"b": 1}, "\u0061": 2})"}) {
    EXPECT_EQ(name_said_twice(text), "a") << text;
    EXPECT_LT(values_of(parse<Json>(text)), count_values(text)) << text;
    EXPECT_LT(values_of(parse<nlohmann::ordered_json>(text)), count_values(text)) << text;
  }
  for (const char* text : {"{}", R"([{"a": 1}, {"a": {"a": ["a", "a"]}}])", "{\"a\": 1", "1", ""})
    EXPECT_EQ(name_said_twice(text), std::nullopt) << text;
}

TEST(JsonText, WhatIsNoJsonIsDiscarded) {
  for (const char* text : {"", "{", "[1,]", "\"", "\xff", "nul"})
    EXPECT_TRUE(parse<Json>(text).is_discarded()) << text;
}

TEST(JsonText, TextThatIsNotUtf8IsWrittenAllTheSame) {
  EXPECT_EQ(to_text(Json{{"file", "a\xff.tif"}}), "{\"file\":\"a\xef\xbf\xbd.tif\"}");
  EXPECT_EQ(to_text(Json::array({1, 2}), 1), "[\n 1,\n 2\n]");
}

}  // namespace
}  // namespace tind::json
