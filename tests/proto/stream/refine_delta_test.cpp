#include "proto/stream/refine_delta.h"

#include <gtest/gtest.h>

#include <random>

namespace tind::proto {
namespace {

RefineDelta some() {
  RefineDelta d;
  d.view = "0123abcd";
  d.lon = -121.5, d.lat = 46.75;
  d.removed_triangles = {0, 7, 8, 4000000000u};
  d.removed_vertices = {3};
  d.vertices = {{5, {1.5f, -2, 3}}, {900, {0, 0, 0}}};
  d.triangles = {{1, {5, 900, 4294967295u}}, {70000, {0, 5, 1}}};
  return d;
}

TEST(RefineDelta, ComesBackAsItWas) {
  EXPECT_EQ(*decode_refine_delta(encode(some())), some());
  RefineDelta whole;
  whole.whole = true;
  EXPECT_EQ(*decode_refine_delta(encode(whole)), whole);
}

TEST(RefineDelta, IsRefusedWhenCutOrLengthened) {
  const std::string bytes = encode(some());
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(decode_refine_delta(std::string_view(bytes).substr(0, n))) << n;
  EXPECT_FALSE(decode_refine_delta(bytes + "x"));
}

TEST(RefineDelta, DamagedBytesAreRefusedOrDecodeToSomethingThatEncodes) {
  std::mt19937 random(1);
  const std::string bytes = encode(some());
  for (int i = 0; i < 20000; ++i) {
    std::string bad = bytes;
    for (int k = 0; k < 1 + i % 3; ++k) bad[random() % bad.size()] = char(random());
    const auto d = decode_refine_delta(bad);
    EXPECT_TRUE(!d || decode_refine_delta(encode(*d)));
  }
}

}  // namespace
}  // namespace tind::proto
