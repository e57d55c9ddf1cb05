// Bytes that nobody's encoder wrote.

#include "proto/stream/mesh_stream.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/base/file_io.h"
#include "tests/support/support.h"

namespace tind::proto {
namespace {

std::vector<std::uint8_t> seed(const std::string& name) {
  const auto file = read_whole_file(test::testdata("fuzz/tpm_fuzz/" + name));
  EXPECT_TRUE(file) << name;
  return {file->begin(), file->end()};
}

std::size_t most_splits(std::size_t bytes) { return 1024 + 2 * bytes; }

/// 1,425 bytes that say 200,000 splits, each as the coder expects it: 40 MB.
TEST(MeshStream, AFewBytesAreNotTakenForMillionsOfSplits) {
  const auto got = decode_mesh_stream(seed("many_splits_in_few_bytes.tpm"));
  ASSERT_FALSE(got);
  EXPECT_NE(got.error().what.find("two splits a byte"), std::string::npos) << got.error().what;
}

TEST(MeshStream, WhatIsRefusedIsNotWrittenEither) {
  MeshStream s;
  s.frame = StreamFrame::space;
  s.base_vertices.assign(4, LatticePoint{});
  s.base_triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  for (const std::uint32_t n : {1000u, 20000u}) {
    s.total_splits = n;
    s.blocks = {{n, 0}};
    s.splits.clear();
    for (std::uint32_t i = 0; i < n; ++i) s.splits.push_back({i == 0 ? 0 : 3 + i, 1, 2, {}, {}});
    EXPECT_EQ(encode(s).has_value(), n == 1000u);
  }
}

TEST(MeshStream, ChangedBytesNeverTakeMemoryOutOfProportion) {
  std::mt19937 random(7);
  for (const char* name : {"many_splits_in_few_bytes.tpm", "space.tpm", "crater1.tpm"}) {
    const std::vector<std::uint8_t> whole = seed(name);
    for (int round = 0; round < 300; ++round) {
      std::vector<std::uint8_t> bytes = whole;
      for (int k = 0; k < 1 + round % 4; ++k)
        bytes[random() % bytes.size()] = std::uint8_t(random());
      if (round % 3 == 0) bytes.resize(1 + random() % bytes.size());
      if (round % 3 == 1) bytes.resize(bytes.size() + random() % 2000, std::uint8_t(random()));
      const auto got = decode_mesh_stream(bytes);
      if (!got) continue;
      EXPECT_LE(got->splits.size(), most_splits(bytes.size()));
      EXPECT_LE(got->base_vertices.size() + got->base_triangles.size(), bytes.size());
    }
  }
}

}  // namespace
}  // namespace tind::proto
