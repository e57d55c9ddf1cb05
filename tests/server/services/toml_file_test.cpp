// How deep a text may go, whatever is in its strings and comments.

#include "server/services/datasets/toml_file.h"

#include <gtest/gtest.h>

namespace tind::services {
namespace {

std::string times(int n, const std::string& text) {
  std::string out;
  for (int i = 0; i < n; ++i) out += text;
  return out;
}

std::string error(const std::string& text) {
  const auto table = parse_toml(text, "x.toml");
  return table ? "" : table.error().what;
}

constexpr int kMany = 200'000;  // enough for any stack

TEST(TomlFile, KeysAreNestedAsLittleAsValues) {
  const std::string refused = " is nested more than 64 deep, and no settings are";
  EXPECT_EQ(error(times(kMany, "a.") + "b = 1\n"), "x.toml:1:" + refused);
  EXPECT_EQ(error("a = 1\n\n[" + times(kMany, "a.") + "b]\n"), "x.toml:3:" + refused);
  EXPECT_EQ(error("[[" + times(kMany, "a . ") + "b]]\n"), "x.toml:1:" + refused);
  EXPECT_EQ(error(times(kMany, "'a'.\"b\".") + "b = 1\n"), "x.toml:1:" + refused);
  EXPECT_EQ(error("a = " + times(kMany, "[")), "x.toml:1:" + refused);
  EXPECT_EQ(error(times(kMany, "a = {")), "x.toml:1:" + refused);
  // Each line and each bracket takes a part of it.
  EXPECT_EQ(error("b = " + times(12, "[\n{" + times(5, "a.") + "a = ")), "x.toml:11:" + refused);
}

TEST(TomlFile, WhatLooksLikeAStringHidesNothing) {
  const std::string deep = times(kMany, "a.") + "b = 1\n";
  for (const char* before :
       {"s = \"\"\"\"\"\"\"\"\n", "s = ''''''''\n", "s = \"\"\"x\\\"\"\"\"\n", "s = '\\'\n",
        "s = \"\"\n", "s = \"\\\\\"\n", "# \"\n", "s = '''\n\"'''\n", "s = '#'\n", "s = \"'\"\n"}) {
    const auto as_it_is = parse_toml(before, "x.toml");
    EXPECT_TRUE(as_it_is) << before << as_it_is.error().what;
    EXPECT_NE(error(before + deep).find("nested more than"), std::string::npos) << before;
  }
}

TEST(TomlFile, DotsAndBracketsOfTextsAreNoNesting) {
  const std::string text = times(100, "a.[{\\\"");
  EXPECT_EQ(error("s = \"" + text + "\"\n"), "");
  EXPECT_EQ(error("s = \"\"\"" + text + "\n\"\"" + text + "\"\"\"\"\"\n"), "");
  EXPECT_EQ(error("s = '" + text + "'\n# " + text + "\n"), "");
  EXPECT_EQ(error("s = '''" + text + "'\n" + text + "'''\n"), "");
  EXPECT_EQ(error("s = [" + times(100, "1.5, ") + "]\n"), "");
  EXPECT_EQ(error("s = [" + times(100, "{ a.b = 1 },\n") + "]\n"), "");
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += "[a.b" + std::to_string(i) + "]\nc.d = 1.5\n";
  EXPECT_EQ(error(lines), "");
  EXPECT_EQ(error(times(63, "a.") + "b = 1\n"), "");
}

TEST(TomlFile, NoTextHoldsTheCharacterThatEndsNamesOfFiles) {
  EXPECT_NE(error("a = 1\ns = \"a.tif\\u0000x\"\n").find("x.toml:2: a text holds the character 0"),
            std::string::npos);
}

/// Which toml++ 3.3 takes for impossible.
TEST(TomlFile, AControlCharacterBeginsNoKey) {
  for (const char* wrong : {"[\x01layer]\n", "a = 1\n[[\x06layer]]\n"})
    EXPECT_NE(error(wrong).find("control characters"), std::string::npos) << error(wrong);
}

/// toml++ 3.3 calls U+00A1 to U+0499 unreachable there.
TEST(TomlFile, LettersThatAreNotAsciiStandInQuotes) {
  for (const char* wrong : {"gr\xc3\xb6\xc3\x9f"
                            "e = 1",
                            "a = 1\na.\xc8\x9e = 2", "a = [1,\xd1\x9e]", "\xff"}) {
    const auto read = parse_toml(wrong, "t");
    ASSERT_FALSE(read) << wrong;
    EXPECT_NE(read.error().what.find("stand in quotes"), std::string::npos) << read.error().what;
  }
  const auto read = parse_toml(
      "\xef\xbb\xbf\"gr\xc3\xb6\xc3\x9f"
      "e\" = '\xd1\x9e'  # \xc3\xa9",
      "t");
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->at(0).key,
            "gr\xc3\xb6\xc3\x9f"
            "e");
}

/// Nor what follows a quote or a bracket in a word, which toml++ goes on with.
TEST(TomlFile, QuotesAndBracketsStandWhereTheyMay) {
  for (const char* wrong :
       {"a = 1b\"\"\"\xd1\x9e", "a = 1.\"\xd1\x9e\"", "a = [1,\n2'\xd1\x9e']", "a\"b\" = 1",
        "a = 'b''c'", "a = \"b\" 'c'", "a = 8[[\"\xd1\x9e\"", "a = 1{'\xd1\x9e'",
        "a = 1 = '\xd1\x9e'", "a = {b = 1\t['\xd1\x9e']}"}) {
    const auto read = parse_toml(wrong, "t");
    ASSERT_FALSE(read) << wrong;
    EXPECT_NE(read.error().what.find("in the middle of a word"), std::string::npos)
        << read.error().what;
  }
  EXPECT_EQ(error("[ \"a\" . 'b' ]\nc.\"d\" = {\"e\".'f' = [\t'g', # h\n \"i\"], 'j' = ''}\n"
                  "\"k\" = [[1.5, 2], [\"l\"], [{ m = true, \"n\" = 7 }]]\r\n"
                  "[[o]]\n\"p\" = inf # '\n"),
            "");
}

/// Which toml++ 3.3 looks at as if no string were around.
TEST(TomlFile, NoOtherLetterFollowsABackslash) {
  for (const char* wrong :
       {"s = \"\\\xd1\x9e\"", "s = \"\"\"a\\\xd1\x9e\"\"\"", "s = \"\"\"a\\ \n\t \xd1\x9e\"\"\"",
        "s = \"\"\"\\\\\\\r\n\xd1\x9e\"\"\"", "s = \"\"\"\\\n\\\xd1\x9e\"\"\""}) {
    const auto read = parse_toml(wrong, "t");
    ASSERT_FALSE(read) << wrong;
    EXPECT_NE(read.error().what.find("behind a backslash"), std::string::npos) << read.error().what;
  }
  for (const char* right : {"s = \"\\\\\xd1\x9e\"", "s = '\\\xd1\x9e'", "s = '''\\\n\xd1\x9e'''",
                            "s = \"\"\"\\\n b\xd1\x9e\"\"\"", "s = \"\\t\xd1\x9e\" # \\\xd1\x9e"})
    EXPECT_EQ(error(right), "") << right;
}

}  // namespace
}  // namespace tind::services
