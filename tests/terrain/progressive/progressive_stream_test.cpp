#include "terrain/progressive/stream/progressive_stream.h"

#include <gtest/gtest.h>

#include <atomic>
#include <random>

#include "terrain/base/parallel.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/progressive/stream/make_progressive.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/simplify/methods.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/expand.h"

namespace tind {
namespace {

constexpr Lattice kLattice{4, 0.25};

struct Made {
  HeightGrid grid;
  ProgressiveMesh mesh;
  proto::MeshStream stream;
  std::vector<std::uint8_t> bytes;
};

Made make(const std::string& method, int side, bool voids = false) {
  Made m;
  m.grid = test::rough_terrain(side, side, 9, 3.0f * float(side));
  if (voids)
    for (int r = 8; r < 14; ++r)
      for (int c = 4; c < 20 - r; ++c) m.grid.at(c, r) = HeightGrid::kVoid;
  SimplifyOptions o;
  o.method = *method_named(method);
  o.stop.max_error_m = 2;
  auto mesh = make_progressive({m.grid, 30, 30}, o, 10, {}, kLattice);
  EXPECT_TRUE(mesh) << mesh.error().what;
  m.mesh = std::move(*mesh);
  DemInfo info;
  info.cols = info.rows = side;
  info.crs_name = "made up", info.crs_wkt = "LOCAL_CS[]";
  info.post_to_crs = {100, 0.25, 0, 50, 0, -0.25};
  info.datum = VerticalDatum::egm96;
  auto stream = to_stream(m.mesh, kLattice, info);
  EXPECT_TRUE(stream) << stream.error().what;
  m.stream = std::move(*stream);
  auto bytes = encode(m.stream);
  EXPECT_TRUE(bytes) << bytes.error().what;
  m.bytes = std::move(*bytes);
  return m;
}

TEST(ProgressiveStream, TheOrderOfTheStreamKeepsEveryStateValidAndWithinItsError) {
  for (const char* method : {"bounded", "qem", "edge-cost", "triangle-collapse"}) {
    const Made m = make(method, 40, true);
    const ProgressiveMesh pm = from_stream(m.stream);
    ASSERT_EQ(pm.splits.size(), m.mesh.splits.size());
    Tin mesh = pm.base;
    const auto uncovered = vertical_error(mesh, m.grid).uncovered;
    for (std::size_t i = 0;; ++i) {
      ASSERT_TRUE(check_validity(mesh).ok()) << method << " before split " << i;
      const VerticalError e = vertical_error(mesh, m.grid);
      ASSERT_LE(e.max_m, i < pm.splits.size() ? pm.splits[i].error_m : pm.fine_error_m) << i;
      ASSERT_EQ(e.uncovered, uncovered);
      if (i == pm.splits.size()) break;
      ASSERT_EQ(mesh.vertices[pm.splits[i].vertex], pm.splits[i].vertex_coarse);
      test::apply_split(mesh, pm.splits[i]);
    }
    // The fine end is the same set of triangles as before.
    const Tin plain = test::expand(m.mesh, m.mesh.splits.size());
    const auto corners = [](const Tin& t) {
      std::vector<std::array<double, 9>> all;
      for (Triangle f : t.triangles) {
        const auto less = [&](auto a, auto b) {
          const Vec3 &p = t.vertices[a], &q = t.vertices[b];
          return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
        };
        std::ranges::rotate(f, std::ranges::min_element(f, less));
        std::array<double, 9> c;
        for (int k = 0; k < 9; ++k)
          c[k] = k % 3 == 0 ? t.vertices[f[k / 3]].x
                            : (k % 3 == 1 ? t.vertices[f[k / 3]].y : t.vertices[f[k / 3]].z);
        all.push_back(c);
      }
      std::ranges::sort(all);
      return all;
    };
    EXPECT_EQ(corners(mesh), corners(plain)) << method;
  }
}

TEST(ProgressiveStream, WhatIsDecodedIsWhatWasEncoded) {
  for (const char* method : {"bounded", "qem", "edge-cost", "memoryless", "triangle-collapse"}) {
    const Made m = make(method, 50);
    const auto back = proto::decode_mesh_stream(m.bytes);
    ASSERT_TRUE(back) << method << ": " << back.error().what;
    EXPECT_EQ(back->splits, m.stream.splits);
    EXPECT_EQ(back->blocks, m.stream.blocks);
    EXPECT_EQ(back->base_vertices, m.stream.base_vertices);
    EXPECT_EQ(back->base_triangles, m.stream.base_triangles);
    const DemInfo info = info_of(*back);
    EXPECT_EQ(info.crs_name, "made up");
    EXPECT_EQ(info.crs_wkt, "LOCAL_CS[]");
    EXPECT_EQ(info.post_to_crs, (Affine{100, 0.25, 0, 50, 0, -0.25}));
    EXPECT_EQ(info.datum, VerticalDatum::egm96);
    EXPECT_EQ(info.cols, 50);
    EXPECT_EQ(*encode(*back), m.bytes);
  }
}

/// The prefix's mesh, if it reaches beyond the base, is the state of the whole stream.
void check_prefix(const Made& m, const ProgressiveMesh& whole, ProgressiveCursor& cursor,
                  std::size_t bytes, std::size_t* splits) {
  const auto part = proto::decode_mesh_stream(std::span(m.bytes).first(bytes));
  if (!part) {
    ASSERT_NE(part.error().what.find("base"), std::string::npos)
        << bytes << ": " << part.error().what;
    ASSERT_EQ(*splits, 0u);
    return;
  }
  ASSERT_GE(part->splits.size(), *splits) << "more bytes, fewer splits, at " << bytes;
  *splits = part->splits.size();
  const ProgressiveMesh pm = from_stream(*part);
  auto opened = ProgressiveCursor::open(pm);
  ASSERT_TRUE(opened);
  opened->seek(pm.splits.size());
  cursor.seek(pm.splits.size());
  const Tin now = opened->extract();
  ASSERT_EQ(now.vertices, cursor.extract().vertices);
  ASSERT_EQ(now.triangles, cursor.extract().triangles);
  ASSERT_GE(pm.fine_error_m, pm.splits.size() < whole.splits.size()
                                 ? double(whole.splits[pm.splits.size()].error_m)
                                 : whole.fine_error_m);
}

TEST(ProgressiveStream, CutAtEveryByteASmallStreamIsAValidMesh) {
  const Made m = make("bounded", 33);
  const ProgressiveMesh whole = from_stream(m.stream);
  auto cursor = ProgressiveCursor::open(whole);
  std::size_t splits = 0, valid = 0;
  for (std::size_t bytes = 4; bytes <= m.bytes.size(); ++bytes) {
    check_prefix(m, whole, *cursor, bytes, &splits);
    if (HasFatalFailure()) return;
    if (splits == 0) continue;
    ASSERT_TRUE(check_validity(cursor->extract()).ok());
    ++valid;
  }
  EXPECT_EQ(splits, whole.splits.size());
  EXPECT_GT(valid, m.bytes.size() / 2);
}

TEST(ProgressiveStream, CutAtRandomBytesABigStreamIsAValidMesh) {
  const Made m = make("qem", 130);
  const ProgressiveMesh whole = from_stream(m.stream);
  ASSERT_GT(m.bytes.size(), 10000u);
  auto cursor = ProgressiveCursor::open(whole);
  std::mt19937 random(4);
  std::vector<std::size_t> cuts(test::kSanitized ? 1000 : 10000);
  for (auto& c : cuts) c = 4 + random() % (m.bytes.size() - 3);
  std::ranges::sort(cuts);
  // Every state is valid (checked above); here each cut must be a state, and states only grow.
  std::vector<std::size_t> reached(cuts.size(), 0);
  std::atomic<int> wrong = 0;
  parallel_for(cuts.size(), 0, [&](std::size_t i) {
    const auto part = proto::decode_mesh_stream(std::span(m.bytes).first(cuts[i]));
    if (!part) {
      wrong += part.error().what.find("base") == std::string::npos;
      return;
    }
    reached[i] = part->splits.size();
    wrong += !std::equal(part->splits.begin(), part->splits.end(), m.stream.splits.begin());
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_TRUE(std::ranges::is_sorted(reached));
  EXPECT_GT(reached.back(), whole.splits.size() / 2);
  std::size_t splits = 0;
  for (std::size_t i = 0; i < cuts.size(); i += cuts.size() / 100) {
    check_prefix(m, whole, *cursor, cuts[i], &splits);
    if (HasFatalFailure()) return;
  }
}

TEST(ProgressiveStream, RefusesWhatItCannotHold) {
  Made m = make("qem", 20);
  EXPECT_FALSE(to_stream(m.mesh, {4, 0}, {}));
  EXPECT_FALSE(to_stream(m.mesh, {4, 0.3}, {}));
  const auto refused = [&](std::vector<std::uint8_t> bytes) {
    return !proto::decode_mesh_stream(bytes).has_value();
  };
  auto bytes = m.bytes;
  bytes[0] = 'X';
  EXPECT_TRUE(refused(bytes));
  bytes = m.bytes;
  bytes[4] = 2;  // version
  EXPECT_TRUE(refused(bytes));
  bytes = m.bytes;
  bytes.push_back(0);
  EXPECT_TRUE(refused(bytes));
  m.stream.splits[5].left = m.stream.splits[5].right;
  EXPECT_FALSE(encode(m.stream));
}

}  // namespace
}  // namespace tind
