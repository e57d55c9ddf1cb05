// Decoded by the library's own decoder; other people's are in tests/clients.

#include "proto/tile/meshopt.h"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <array>
#include <random>
#include <set>

namespace tind::proto::meshopt {
namespace {

TEST(Meshopt, VerticesComeBackToTheLastBit) {
  std::mt19937 random(1);
  for (const std::size_t stride : {4u, 8u, 12u})
    for (const std::size_t count : {1u, 15u, 16u, 257u, 5000u}) {
      std::vector<std::uint8_t> bytes(count * stride), back(bytes.size());
      for (auto& b : bytes) b = std::uint8_t(random());
      const auto packed = encode_vertices(bytes, stride);
      EXPECT_EQ(packed[0], 0xa0) << "the version that the extension demands";
      ASSERT_EQ(
          meshopt_decodeVertexBuffer(back.data(), count, stride, packed.data(), packed.size()), 0);
      EXPECT_EQ(back, bytes);
    }
}

TEST(Meshopt, IndicesComeBackInTheirOrder) {
  const std::vector<std::uint32_t> side = {7, 3, 900, 12, 0, 65535};
  const auto packed = encode_indices(side, 65536);
  EXPECT_EQ(packed[0], 0xd1);
  std::vector<std::uint32_t> back(side.size());
  ASSERT_EQ(meshopt_decodeIndexSequence(back.data(), back.size(), 4, packed.data(), packed.size()),
            0);
  EXPECT_EQ(back, side);
}

TEST(Meshopt, TrianglesComeBackWithTheirCornersTurned) {
  std::mt19937 random(2);
  std::vector<std::uint32_t> indices;
  for (int i = 0; i < 3 * 2000; ++i) indices.push_back(std::uint32_t(random() % 700));
  const auto packed = encode_triangles(indices, 700);
  EXPECT_EQ(packed[0], 0xe1);
  std::vector<std::uint32_t> back(indices.size());
  ASSERT_EQ(meshopt_decodeIndexBuffer(back.data(), back.size(), 4, packed.data(), packed.size()),
            0);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const auto turned = [&](std::size_t k) {
      return std::array{indices[i + k], indices[i + (k + 1) % 3], indices[i + (k + 2) % 3]};
    };
    const std::set<std::array<std::uint32_t, 3>> same = {turned(0), turned(1), turned(2)};
    EXPECT_TRUE(same.contains({back[i], back[i + 1], back[i + 2]})) << i;
  }
}

}  // namespace
}  // namespace tind::proto::meshopt
