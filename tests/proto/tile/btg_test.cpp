// BTG: what is written is read again; what others write, too; what is damaged is refused.

#include "proto/tile/btg.h"

#include <gtest/gtest.h>

#include <cmath>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

Btg fan_of(std::uint32_t vertices) {
  Btg btg;
  btg.center = {4e6, -1e6, 5e6};
  btg.radius = 12345.5f;
  for (std::uint32_t i = 0; i < vertices; ++i) {
    btg.vertices.push_back({float(i), float(i) / 2, -float(i)});
    btg.normals.push_back({std::uint8_t(i), 7, 255});
    btg.texcoords.push_back({float(i) / 8, 0.25f});
  }
  Btg::Part land{"Default", {}}, water{"Lake", {}};
  for (std::uint32_t i = 2; i < vertices; ++i)
    (i % 3 == 0 ? water : land).triangles.push_back({{{0, 0, 0}, {i - 1, i, i}, {i, 0, i - 1}}});
  btg.parts = {land, water};
  return btg;
}

TEST(Btg, ComesBackAsItWas) {
  for (const std::uint32_t vertices : {4u, 1000u, 65534u, 65535u, 70000u}) {
    const Btg btg = fan_of(vertices);
    const auto bytes = encode(btg);
    EXPECT_EQ(load<std::uint16_t>(bytes.data()), vertices < 65535 ? 7 : 10) << vertices;
    EXPECT_EQ(load<std::uint16_t>(bytes.data() + 2), 0x5347);
    const auto back = decode_btg(bytes);
    ASSERT_TRUE(back) << back.error().what;
    EXPECT_TRUE(*back == btg) << vertices;
  }
}

/// A file of another maker, version 7.
struct Foreign {
  std::vector<std::uint8_t> bytes;
  ByteWriter<> put{bytes};
  explicit Foreign(std::uint16_t objects) {
    put.put(std::uint32_t(0x53470007));
    put.put(std::uint32_t(1234567));
    put.put(objects);
  }
  void object(std::uint8_t kind, std::uint16_t properties, std::uint16_t elements) {
    put.put(kind), put.put(properties), put.put(elements);
  }
  void lists() {
    object(0, 0, 1), put.put(std::uint32_t(28)), put.skip(28);
    object(1, 0, 1), put.put(std::uint32_t(5 * 12));
    for (int i = 0; i < 15; ++i) put.put(float(i));
    object(2, 0, 1), put.put(std::uint32_t(5 * 3)), put.skip(15);
    object(3, 0, 1), put.put(std::uint32_t(5 * 8)), put.skip(40);
  }
  void property(std::uint8_t kind, std::string_view text) {
    put.put(kind), put.put(std::uint32_t(text.size())), put.put_text(text);
  }
  void indices(std::initializer_list<std::uint16_t> all) {
    put.put(std::uint32_t(2 * all.size()));
    for (const auto i : all) put.put(i);
  }
};

std::vector<std::array<std::uint32_t, 3>> vertices_of(const Btg::Part& part) {
  std::vector<std::array<std::uint32_t, 3>> all;
  for (const auto& t : part.triangles) all.push_back({t[0].vertex, t[1].vertex, t[2].vertex});
  return all;
}

TEST(Btg, ReadsStripsFansAndMasks) {
  Foreign file(8);
  file.lists();
  file.object(11, 2, 1);  // a strip with all that a corner may have
  file.property(0, "Rock"), file.property(1, "\x0f");
  file.indices({0, 4, 0, 1, 1, 4, 0, 2, 2, 4, 0, 3, 3, 4, 0, 4});
  file.object(12, 1, 2);  // two fans without a mask: vertex and texture coordinate
  file.property(0, "Lake");
  file.indices({0, 1, 1, 1, 2, 1, 3, 1}), file.indices({4, 0, 3, 0, 2, 0});
  file.object(9, 0, 1), file.indices({1, 2});  // points
  file.object(77, 1, 1), file.property(3, "?"), file.indices({9, 9, 9});
  const auto btg = decode_btg(file.bytes);
  ASSERT_TRUE(btg) << btg.error().what;
  ASSERT_EQ(btg->parts.size(), 2u);
  EXPECT_EQ(btg->parts[0].material, "Rock");
  using Triangles = std::vector<std::array<std::uint32_t, 3>>;
  EXPECT_EQ(vertices_of(btg->parts[0]), (Triangles{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(btg->parts[0].triangles[0][2], (Btg::Corner{2, 4, 3}));
  EXPECT_EQ(vertices_of(btg->parts[1]), (Triangles{{0, 1, 2}, {0, 2, 3}, {4, 3, 2}}));
  EXPECT_EQ(btg->parts[1].triangles[0][1], (Btg::Corner{1, 1, 1}));
}

TEST(Btg, RefusesEveryBeginning) {
  const auto bytes = encode(fan_of(9));
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const auto cut = decode_btg(std::span(bytes).first(n));
    ASSERT_FALSE(cut) << n;
    EXPECT_EQ(cut.error().code, Errc::bad_data) << n;
  }
}

TEST(Btg, RefusesWhatIsNotThere) {
  Btg btg = fan_of(5);
  btg.parts[0].triangles[0][1].texcoord = 5;
  EXPECT_FALSE(decode_btg(encode(btg)));
  btg = fan_of(5);
  btg.vertices[3][1] = NAN;
  EXPECT_FALSE(decode_btg(encode(btg)));
  auto bytes = encode(fan_of(5));
  bytes[0] = 6;  // a version before
  EXPECT_EQ(decode_btg(bytes).error().code, Errc::unsupported);
  bytes[2] = 0x1f;  // no BTG at all
  EXPECT_EQ(decode_btg(bytes).error().code, Errc::bad_data);
}

}  // namespace
}  // namespace tind::proto
