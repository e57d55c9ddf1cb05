#include "proto/tile/quantized_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/support/support.h"

namespace tind::proto {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

bool operator==(const QuantizedMesh& a, const QuantizedMesh& b) {
  return a.center == b.center && a.min_height == b.min_height && a.max_height == b.max_height &&
         a.bounding_sphere == b.bounding_sphere && a.horizon_occlusion == b.horizon_occlusion &&
         a.u == b.u && a.v == b.v && a.h == b.h && a.triangles == b.triangles && a.west == b.west &&
         a.south == b.south && a.east == b.east && a.north == b.north &&
         a.oct_normals == b.oct_normals && a.water_mask == b.water_mask && a.metadata == b.metadata;
}

/// cells x cells squares, two triangles each, with vertices in no good order.
QuantizedMesh grid(std::uint32_t cells, unsigned seed = 1) {
  std::mt19937 random(seed);
  QuantizedMesh m;
  m.center = {1, 2, 3};
  m.min_height = -5;
  m.max_height = 95.5f;
  m.bounding_sphere = {4, 5, 6, 7};
  m.horizon_occlusion = {8, 9, 10};
  const std::uint32_t side = cells + 1;
  std::vector<std::uint32_t> name(side * side);
  for (std::uint32_t i = 0; i < name.size(); ++i) name[i] = i;
  std::shuffle(name.begin(), name.end(), random);
  m.u.resize(name.size());
  m.v.resize(name.size());
  m.h.resize(name.size());
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t i = name[y * side + x];
      m.u[i] = std::uint16_t(x * 32767ull / cells);
      m.v[i] = std::uint16_t(y * 32767ull / cells);
      m.h[i] = std::uint16_t(random() % 32768);
    }
  for (std::uint32_t y = 0; y < cells; ++y)
    for (std::uint32_t x = 0; x < cells; ++x) {
      const auto at = [&](std::uint32_t dx, std::uint32_t dy) {
        return name[(y + dy) * side + x + dx];
      };
      m.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
      m.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
    }
  return m;
}

QuantizedMesh arranged_grid(std::uint32_t cells) {
  QuantizedMesh m = grid(cells);
  arrange(m);
  return m;
}

QuantizedMesh with_extensions(QuantizedMesh m) {
  for (std::size_t i = 0; i < m.u.size(); ++i)
    m.oct_normals.push_back({std::uint8_t(i), std::uint8_t(i * 7)});
  m.water_mask = {255};
  m.metadata = R"({"max_error_m":1.5})";
  return m;
}

QuantizedMesh must_decode(std::span<const std::uint8_t> bytes) {
  auto m = decode(bytes);
  EXPECT_TRUE(m.has_value()) << m.error().what;
  return m.value_or(QuantizedMesh{});
}

std::string why_not(std::span<const std::uint8_t> bytes) {
  const auto m = decode(bytes);
  EXPECT_FALSE(m);
  return m ? "" : m.error().what;
}

TEST(QuantizedMesh, TheSmallestTileByteByByte) {
  QuantizedMesh m;
  m.u = {0, 32767, 0, 32767};
  m.v = {0, 0, 32767, 32767};
  m.h = {0, 1, 0, 32767};
  m.triangles = {{0, 1, 2}, {2, 1, 3}};
  arrange(m);
  const Bytes bytes = encode(m);
  const Bytes body(bytes.begin() + 88, bytes.end());
  EXPECT_EQ(body, (Bytes{4, 0, 0,    0,                             // vertices
                         0, 0, 0xfe, 0xff, 0xfd, 0xff, 0xfe, 0xff,  // u: 0 +32767 -32767 +32767
                         0, 0, 0,    0,    0xfe, 0xff, 0,    0,     // v: 0 0 +32767 0
                         0, 0, 2,    0,    1,    0,    0xfe, 0xff,  // h: 0 +1 -1 +32767
                         2, 0, 0,    0,                             // triangles
                         0, 0, 0,    0,    0,    0,    1,    0,
                         2, 0, 0,    0,                             // new new new, 3-2, 3-1, new
                         2, 0, 0,    0,    0,    0,    2,    0,     // west, south to north
                         2, 0, 0,    0,    1,    0,    0,    0,     // south, east to west
                         2, 0, 0,    0,    3,    0,    1,    0,     // east, north to south
                         2, 0, 0,    0,    2,    0,    3,    0}));  // north, west to east
}

TEST(QuantizedMesh, HeaderIsLittleEndianInItsPlaces) {
  QuantizedMesh m = arranged_grid(1);
  m.center = {1.5, 0, 0};
  const Bytes bytes = encode(m);
  EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 8), (Bytes{0, 0, 0, 0, 0, 0, 0xf8, 0x3f}));
  EXPECT_EQ(Bytes(bytes.begin() + 28, bytes.begin() + 32), (Bytes{0, 0, 0xbf, 0x42}));  // 95.5f
}

TEST(QuantizedMesh, DecodeGivesBackWhatWasEncoded) {
  for (const std::uint32_t cells : {1u, 2u, 7u, 64u, 255u}) {
    const QuantizedMesh m = with_extensions(arranged_grid(cells));
    EXPECT_TRUE(must_decode(encode(m)) == m) << cells;
  }
}

TEST(QuantizedMesh, IndicesGrowTo32BitsBeyond65536Vertices) {
  const QuantizedMesh last_small = arranged_grid(255);  // 256 x 256 = 65536
  ASSERT_EQ(last_small.u.size(), 65536u);
  EXPECT_EQ(encode(last_small).size(),
            92 + 6 * 65536 + 4 + 6 * last_small.triangles.size() + 4 * (4 + 2 * 256));
  const QuantizedMesh large = arranged_grid(256);  // 257 x 257 = 66049, odd: padded
  const Bytes bytes = encode(large);
  EXPECT_EQ(bytes.size(), 92 + 6 * 66049 + 2 + 4 + 12 * large.triangles.size() + 4 * (4 + 4 * 257));
  EXPECT_TRUE(must_decode(bytes) == large);

  Bytes unpadded = bytes;  // what some tilers write must not be read as something else
  unpadded.erase(unpadded.begin() + 92 + 6 * 66049, unpadded.begin() + 94 + 6 * 66049);
  EXPECT_FALSE(why_not(unpadded).empty());
}

TEST(QuantizedMesh, OfThe65536VerticesThatHave16BitsTheFirstCanBeUsedAtTheEnd) {
  QuantizedMesh m = grid(255);
  ASSERT_EQ(m.u.size(), 65536u);
  std::rotate(m.triangles.begin() + 1, m.triangles.begin() + 2, m.triangles.end());
  ASSERT_EQ(m.triangles.front()[0], m.triangles.back()[0]);
  arrange(m);
  EXPECT_TRUE(must_decode(encode(m)) == m);
}

TEST(QuantizedMesh, ArrangeKeepsTheGeometry) {
  QuantizedMesh before = grid(9);
  const std::size_t used = before.u.size();
  before.u.push_back(1), before.v.push_back(2), before.h.push_back(3);  // used by no triangle
  QuantizedMesh after = before;
  arrange(after);
  ASSERT_EQ(after.u.size(), used);
  ASSERT_EQ(after.triangles.size(), before.triangles.size());
  std::uint32_t next = 0;
  for (std::size_t t = 0; t < after.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = after.triangles[t][k], b = before.triangles[t][k];
      EXPECT_EQ(std::tie(after.u[a], after.v[a], after.h[a]),
                std::tie(before.u[b], before.v[b], before.h[b]));
      EXPECT_LE(a, next);
      next += a == next;
    }
}

TEST(QuantizedMesh, ArrangeSortsTheEdgesAroundTheTile) {
  const QuantizedMesh m = arranged_grid(5);
  const auto positions = [](std::span<const std::uint32_t> edge,
                            const std::vector<std::uint16_t>& x) {
    std::vector<int> values;
    for (const std::uint32_t i : edge) values.push_back(x[i]);
    return values;
  };
  EXPECT_THAT(positions(m.west, m.v), ElementsAre(0, 6553, 13106, 19660, 26213, 32767));
  EXPECT_THAT(positions(m.south, m.u), ElementsAre(32767, 26213, 19660, 13106, 6553, 0));
  EXPECT_THAT(positions(m.east, m.v), ElementsAre(32767, 26213, 19660, 13106, 6553, 0));
  EXPECT_THAT(positions(m.north, m.u), ElementsAre(0, 6553, 13106, 19660, 26213, 32767));
  EXPECT_THAT(positions(m.south, m.v), testing::Each(0));
  EXPECT_THAT(positions(m.north, m.v), testing::Each(32767));
}

TEST(QuantizedMesh, ExtensionsHaveLittleEndianLengths) {
  QuantizedMesh m = arranged_grid(1);
  const std::size_t plain = encode(m).size();
  m = with_extensions(m);
  const Bytes bytes = encode(m);
  const Bytes extensions(bytes.begin() + long(plain), bytes.end());
  EXPECT_THAT(Bytes(extensions.begin(), extensions.begin() + 5), ElementsAre(1, 8, 0, 0, 0));
  EXPECT_THAT(Bytes(extensions.begin() + 13, extensions.begin() + 19),
              ElementsAre(2, 1, 0, 0, 0, 255));
  EXPECT_THAT(Bytes(extensions.begin() + 19, extensions.begin() + 28),
              ElementsAre(4, 23, 0, 0, 0, 19, 0, 0, 0));
  EXPECT_EQ(std::string(extensions.begin() + 28, extensions.end()), m.metadata);
}

TEST(QuantizedMesh, StrippingEqualsEncodingWithout) {
  const QuantizedMesh full = with_extensions(arranged_grid(4));
  const Bytes bytes = encode(full);
  for (int mask = 0; mask < 8; ++mask) {
    const Extensions keep{(mask & 1) != 0, (mask & 2) != 0, (mask & 4) != 0};
    QuantizedMesh wanted = full;
    if (!keep.normals) wanted.oct_normals.clear();
    if (!keep.water_mask) wanted.water_mask.clear();
    if (!keep.metadata) wanted.metadata.clear();
    EXPECT_EQ(strip_extensions(bytes, keep), encode(wanted)) << mask;
  }
  const Bytes nonsense = {1, 2, 3};
  EXPECT_EQ(strip_extensions(nonsense, {}), nonsense);
}

TEST(QuantizedMesh, UnknownExtensionsAreSkippedByTheirLength) {
  const QuantizedMesh m = arranged_grid(2);
  Bytes bytes = encode(m);
  bytes.insert(bytes.end(), {200, 3, 0, 0, 0, 9, 9, 9, 2, 1, 0, 0, 0, 0});
  EXPECT_THAT(must_decode(bytes).water_mask, ElementsAre(0));
  EXPECT_EQ(strip_extensions(bytes, {}), encode(m));
}

TEST(QuantizedMesh, LegacyBigEndianNormalsAreRead) {
  QuantizedMesh m = arranged_grid(2);
  const Bytes plain = encode(m);
  m = with_extensions(m);
  m.metadata.clear();
  Bytes bytes = encode(m);
  std::reverse(bytes.begin() + long(plain.size()) + 1, bytes.begin() + long(plain.size()) + 5);
  std::reverse(bytes.end() - 5, bytes.end() - 1);
  EXPECT_TRUE(must_decode(bytes) == m);
}

TEST(QuantizedMesh, EveryTruncationIsRefused) {
  const QuantizedMesh m = with_extensions(arranged_grid(3));
  const Bytes bytes = encode(m);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto part = decode(std::span(bytes).first(size));
    if (!part) {
      EXPECT_FALSE(part.error().what.empty());
      continue;
    }
    EXPECT_TRUE(part->metadata.empty()) << size;  // only a cut between two extensions is a tile
  }
}

TEST(QuantizedMesh, SaysWhatIsWrong) {
  const Bytes good = encode(arranged_grid(1));
  const auto with = [&](std::size_t at, Bytes change) {
    Bytes bytes = good;
    std::copy(change.begin(), change.end(), bytes.begin() + long(at));
    return bytes;
  };
  EXPECT_THAT(why_not({}), HasSubstr("header"));
  EXPECT_THAT(why_not(with(0, {0x1f, 0x8b})), HasSubstr("gzip"));
  EXPECT_THAT(why_not(Bytes{0x1f, 0x8b}), HasSubstr("gzip"));
  EXPECT_THAT(why_not(with(6, {0xf0, 0x7f})), HasSubstr("centre"));
  EXPECT_THAT(why_not(with(26, {0xff, 0x7f})), HasSubstr("height"));
  EXPECT_THAT(why_not(with(62, {0xf0, 0xff})), HasSubstr("sphere"));
  EXPECT_THAT(why_not(with(70, {0xf8, 0x7f})), HasSubstr("occlusion"));
  EXPECT_THAT(why_not(with(88, {255, 255, 255, 255})), HasSubstr("vertices"));
  EXPECT_THAT(why_not(with(92, {1, 0})), HasSubstr("u of vertex 0 is -1"));
  EXPECT_THAT(why_not(with(116, {255, 255, 255, 255})), HasSubstr("triangles"));
  EXPECT_THAT(why_not(with(120, {1, 0})), HasSubstr("triangle 0 names a vertex"));
  // Six first uses, of four vertices.
  EXPECT_THAT(why_not(with(120, Bytes(12, 0))), HasSubstr("triangle 1 names a vertex"));
  // The fifth alone, of four.
  EXPECT_THAT(why_not(with(120, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0})),
              HasSubstr("triangle 1 names a vertex"));
  EXPECT_THAT(why_not(with(132, {255, 255, 255, 255})), HasSubstr("west edge"));
  EXPECT_THAT(why_not(with(136, {4, 0})), HasSubstr("edge list names vertex 4 of 4"));
}

TEST(QuantizedMesh, ForeignTilesAreRead) {
  TIND_NEEDS_SHARED_DATA(folder, "quantized-mesh");
  int tiles = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".terrain") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    const Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    const auto m = decode(bytes);
    ASSERT_TRUE(m.has_value()) << entry.path() << ": " << m.error().what;
    const std::string name = entry.path().filename().string();
    EXPECT_GT(m->triangles.size(), 0u) << name;
    if (name != "tile-opentin.terrain") {  // which has no edge lists at all
      EXPECT_GE(m->west.size(), 2u) << name;
    }
    if (name.find("normals") != name.npos) {
      EXPECT_EQ(m->oct_normals.size(), m->u.size()) << name;
    }
    if (name.find("watermask") != name.npos) {
      EXPECT_FALSE(m->water_mask.empty()) << name;
    }
    if (name.find("metadata") != name.npos) {
      EXPECT_THAT(m->metadata, testing::StartsWith("{")) << name;
    }
    if (name.find("32bit") != name.npos) {
      EXPECT_GT(m->u.size(), 65536u) << name;
    }
    EXPECT_TRUE(must_decode(encode(*m)) == *m) << name;
    ++tiles;
  }
  EXPECT_GE(tiles, 12);
}

}  // namespace
}  // namespace tind::proto
