// The record of a build: what was written is read, and what somebody else wrote does no harm.

#include "terrain/store/build_record.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tind {
namespace {

BuildRecord record() {
  BuildRecord r;
  r.epoch = 4;
  r.grid = "g";
  r.heights = "h";
  r.max_error_m = 0.1;
  r.error_factor = 2;
  r.deepest_level = 11;
  r.first_level = 3, r.last_level = 9;
  r.side = "above";
  r.vertical_datum = "egm96";
  r.effort = "fast";
  r.gzip = true;
  r.exact_posts = 5'000'000'000;
  r.tiles = "t";
  r.steps_m = {1.0 / 3, 0.25};
  return r;
}

TEST(BuildRecord, EveryMemberComesBack) {
  const std::string text = encode(record());
  const auto read = decode_build_record(text);
  ASSERT_TRUE(read);
  EXPECT_EQ(encode(*read), text);
  // Each by itself: what is not kept would not make another text.
  const auto other = [&](auto&& change) {
    BuildRecord r = record();
    change(r);
    const auto back = decode_build_record(encode(r));
    return encode(r) != text && back && encode(*back) == encode(r);
  };
  EXPECT_TRUE(other([](BuildRecord& r) { r.epoch = 5; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.grid = "x"; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.heights = "x"; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.max_error_m = std::nextafter(0.1, 1); }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.error_factor = 3; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.deepest_level = 12; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.first_level = 0; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.last_level = 8; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.side = "below"; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.effort = "high"; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.method = "qem"; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.gzip = false; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.exact_posts = 0; }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.tiles.clear(); }));
  EXPECT_TRUE(other([](BuildRecord& r) { r.steps_m[0] = std::nextafter(r.steps_m[0], 1); }));
}

TEST(BuildRecord, WhatIsMissingOrOfAnotherKindIsLeftOut) {
  for (const char* text : {"", "[]", "7", "{", "null"}) EXPECT_FALSE(decode_build_record(text));
  const auto none = decode_build_record("{}");
  ASSERT_TRUE(none);
  EXPECT_EQ(encode(*none), encode(BuildRecord{}));
  const auto odd = decode_build_record(
      R"({"epoch": "4", "grid": 1, "max_error_m": "10", "error_factor": [], "side": 7,
          "deepest_level": 1e99, "levels": [1], "gzip": 1, "exact_posts": 0.5, "steps_m": {}})");
  ASSERT_TRUE(odd);
  EXPECT_EQ(encode(*odd), encode(BuildRecord{}));
  const auto steps = decode_build_record(R"({"steps_m": [1, "x"]})");
  ASSERT_TRUE(steps);
  ASSERT_EQ(steps->steps_m.size(), 2u);
  EXPECT_TRUE(std::isnan(steps->steps_m[1])) << "no step equals it";
}

}  // namespace
}  // namespace tind
