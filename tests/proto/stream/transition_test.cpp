// The two binary formats: round trips, and every damaged byte count is refused.

#include "proto/stream/transition.h"

#include <gtest/gtest.h>

#include "proto/stream/tile_frames.h"

namespace tind::proto {
namespace {

Transition small() {
  Transition t;
  t.level = 3, t.x = 5, t.y = 2;
  t.coarse_error_m = 12, t.fine_error_m = 6;
  t.u = {0, 32767, 32767, 0, 16383.5}, t.v = {0, 0, 32767, 32767, 100};
  t.coarse_z = {1, 2, 3, 4, 5}, t.fine_z = {6, 7, 8, 9, 10};
  t.triangles = {{0, 1, 2}, {0, 2, 3}};
  t.splits = {{0, 1, 2}};
  t.fine_vertices = 5;
  return t;
}

TEST(Transition, ComesBackAsItWent) {
  const auto bytes = encode(small());
  const auto back = decode_transition(bytes);
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(encode(*back), bytes);
  EXPECT_EQ(back->splits, small().splits);
  EXPECT_EQ(back->u, small().u);
}

TEST(Transition, EveryPrefixIsRefused) {
  const auto bytes = encode(small());
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const auto back = decode_transition(std::span(bytes).first(n));
    ASSERT_FALSE(back) << n;
    EXPECT_FALSE(back.error().what.empty());
  }
}

TEST(Transition, WrongIndicesAndNumbersAreRefused) {
  Transition t = small();
  t.splits[0][1] = 4;  // the vertex that this split makes
  const auto early = decode_transition(encode(t));
  ASSERT_FALSE(early);
  EXPECT_NE(early.error().what.find("not there yet"), std::string::npos);
  t = small();
  t.triangles[1][2] = 4;
  EXPECT_FALSE(decode_transition(encode(t)));
  t = small();
  t.u[2] = 0.0 / 0.0;
  EXPECT_FALSE(decode_transition(encode(t)));
  t = small();
  t.splits[0][2] = t.splits[0][1];
  EXPECT_FALSE(decode_transition(encode(t)));
}

TEST(TileFrames, ComeBackAsTheyWent) {
  const std::vector<std::uint8_t> tile = {1, 2, 3};
  auto bytes = begin_frames(2);
  append_frame(bytes, {4, 5, 6, 200, tile});
  append_frame(bytes, {4, 5, 7, 404, {}});
  const auto frames = decode_frames(bytes);
  ASSERT_TRUE(frames) << frames.error().what;
  ASSERT_EQ(frames->size(), 2u);
  EXPECT_EQ((*frames)[0].bytes.size(), 3u);
  EXPECT_EQ((*frames)[0].bytes[2], 3);
  EXPECT_EQ((*frames)[1].status, 404u);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(decode_frames(std::span(bytes).first(n))) << n;
  bytes.push_back(0);
  EXPECT_FALSE(decode_frames(bytes));
}

}  // namespace
}  // namespace tind::proto
