// The checker's reader against tiles written by hand from the specification, byte by byte: what it
// reads, and each thing that it must find.

#include "terrain/check/check_decode.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <map>

namespace tind {
namespace {

using Codes = std::vector<std::uint64_t>;

/// A tile in the making: what is not said is that of two triangles over a square.
struct Written {
  std::array<double, 10> doubles = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};  // centre, sphere, horizon
  float lowest = 11, highest = 12;
  std::array<Codes, 3> coordinates = {
      Codes{0, 65534, 65533, 65534}, {0, 0, 65534, 0}, {0, 2, 4, 5}};
  std::size_t padding = 0;
  int index_size = 2;
  Codes codes = {0, 0, 0, 2, 0, 2};  // of the high water mark
  std::array<Codes, 4> edges = {Codes{0, 2}, {0, 1}, {1, 3}, {2, 3}};
  std::vector<std::uint8_t> rest;  // extensions

  std::vector<std::uint8_t> bytes() const {
    std::vector<std::uint8_t> out;
    const auto put = [&](std::uint64_t value, int size) {
      for (int i = 0; i < size; ++i) out.push_back(std::uint8_t(value >> (8 * i)));
    };
    const auto put_double = [&](double d) { put(std::bit_cast<std::uint64_t>(d), 8); };
    for (std::size_t i = 0; i < 3; ++i) put_double(doubles[i]);
    put(std::bit_cast<std::uint32_t>(lowest), 4), put(std::bit_cast<std::uint32_t>(highest), 4);
    for (std::size_t i = 3; i < 10; ++i) put_double(doubles[i]);
    put(coordinates[0].size(), 4);
    for (const Codes& one : coordinates)
      for (const std::uint64_t code : one) put(code, 2);
    out.resize(out.size() + padding);
    put(codes.size() / 3, 4);
    for (const std::uint64_t code : codes) put(code, index_size);
    for (const Codes& edge : edges) {
      put(edge.size(), 4);
      for (const std::uint64_t index : edge) put(index, index_size);
    }
    out.insert(out.end(), rest.begin(), rest.end());
    return out;
  }
  /// An extension of these bytes, its length written as it is, or the other way around.
  void extend(std::uint8_t id, const std::vector<std::uint8_t>& body, bool big_endian = false) {
    rest.push_back(id);
    for (int i = 0; i < 4; ++i)
      rest.push_back(std::uint8_t(body.size() >> (8 * (big_endian ? 3 - i : i))));
    rest.insert(rest.end(), body.begin(), body.end());
  }
};

struct Read {
  bool readable = false;
  CheckedTile tile;
  std::map<std::string, std::uint64_t> found;  // by rule
};

Read read(const std::vector<std::uint8_t>& bytes) {
  Read out;
  Findings findings;
  out.readable = check_decode(bytes, "tile", out.tile, findings);
  for (std::size_t r = 0; r < kCheckRuleCount; ++r)
    if (findings[r].count > 0) out.found[std::string(kCheckRules[r].id)] = findings[r].count;
  return out;
}
Read read(const Written& tile) { return read(tile.bytes()); }

using Found = std::map<std::string, std::uint64_t>;

TEST(CheckDecode, ReadsEachNumberFromItsPlace) {
  const Read got = read(Written{});
  EXPECT_TRUE(got.readable);
  EXPECT_EQ(got.found, Found{});
  EXPECT_EQ(got.tile.center, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(got.tile.sphere, (std::array<double, 4>{4, 5, 6, 7}));
  EXPECT_EQ(got.tile.horizon, (std::array<double, 3>{8, 9, 10}));
  EXPECT_EQ(got.tile.min_height, 11);
  EXPECT_EQ(got.tile.max_height, 12);
  EXPECT_EQ(got.tile.u, (std::vector<std::int32_t>{0, 32767, 0, 32767}));
  EXPECT_EQ(got.tile.v, (std::vector<std::int32_t>{0, 0, 32767, 32767}));
  EXPECT_EQ(got.tile.h, (std::vector<std::int32_t>{0, 1, 3, 0}));
  EXPECT_EQ(got.tile.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(got.tile.edges,
            (std::array<std::vector<std::uint32_t>, 4>{{{0, 2}, {0, 1}, {1, 3}, {2, 3}}}));
  EXPECT_TRUE(got.tile.normals.empty());
  EXPECT_FALSE(got.tile.has_water_mask);
}

TEST(CheckDecode, EachNumberOfTheHeaderIsToBeFinite) {
  for (const double bad :
       {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    for (std::size_t i = 0; i < 12; ++i) {
      Written tile;
      (i < 10 ? tile.doubles[i] : tile.doubles[0]) = i < 10 ? bad : 1;
      if (i == 10) tile.lowest = float(bad);
      if (i == 11) tile.highest = float(bad);
      EXPECT_EQ(read(tile).found, (Found{{"tile.header", 1}})) << i;
    }
  }
}

TEST(CheckDecode, WhateverIsCutOffIsMissed) {
  Written tile;
  tile.extend(4, {2, 0, 0, 0, '{', '}'});
  const std::vector<std::uint8_t> whole = tile.bytes();
  EXPECT_EQ(read(whole).found, Found{});
  const std::size_t extension = Written{}.bytes().size();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Read got = read({whole.begin(), whole.begin() + std::ptrdiff_t(length)});
    EXPECT_EQ(got.readable, length >= extension) << length;
    if (length == extension)
      EXPECT_EQ(got.found, Found{});
    else if (length > extension && length < extension + 5)
      EXPECT_EQ(got.found, (Found{{"tile.trailing", 1}})) << length;
    else
      EXPECT_EQ(got.found, (Found{{"tile.truncated", 1}})) << length;
  }
}

TEST(CheckDecode, ATileOfNoVerticesIsReadAsThat) {
  Written none;
  none.coordinates = {}, none.codes = {}, none.edges = {};
  const Read got = read(none);
  EXPECT_TRUE(got.readable);
  EXPECT_TRUE(got.tile.u.empty() && got.tile.triangles.empty());
}

TEST(CheckDecode, CoordinatesGoFrom0To32767) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Written tile;
    tile.coordinates[axis] = {65534, 0, 65533, 65534};  // 32767, 32767, 0, 32767
    EXPECT_EQ(read(tile).found, Found{}) << axis;
    tile.coordinates[axis] = {65534, 2, 0, 0};  // 32768
    EXPECT_EQ(read(tile).found, (Found{{"tile.quantised", 1}})) << axis;
    EXPECT_FALSE(read(tile).readable);
    tile.coordinates[axis] = {2, 3, 1, 0};  // 1, -1
    EXPECT_EQ(read(tile).found, (Found{{"tile.quantised", 1}})) << axis;
  }
}

TEST(CheckDecode, ACodeNamesAVertexThatWasNamedOrTheNextOne) {
  const auto triangle = [](Codes codes) {
    Written tile;
    tile.codes = std::move(codes);
    return read(tile);
  };
  EXPECT_EQ(triangle({0, 0, 0, 3, 0, 2}).tile.triangles[1],
            (std::array<std::uint32_t, 3>{0, 3, 2}));
  for (const Codes& codes : {Codes{1, 0, 0}, {0, 2, 0}, {0, 0, 4}, {0, 0, 0, 0, 0, 0}}) {
    const Read got = triangle(codes);
    EXPECT_FALSE(got.readable);
    EXPECT_EQ(got.found, (Found{{"tile.index", 1}})) << codes[1];
  }
  EXPECT_TRUE(triangle({0, 0, 3}).found.contains("tile.index"));
  EXPECT_TRUE(triangle({0, 0, 2}).readable) << "the first one again";
}

TEST(CheckDecode, TheOtherLayoutIsSeenForWhatItIs) {
  Written wide;
  wide.index_size = 4;
  EXPECT_TRUE(read(wide).readable);
  EXPECT_EQ(read(wide).found, (Found{{"tile.index-width", 1}}));
  wide.padding = 2;
  EXPECT_EQ(read(wide).found, (Found{{"tile.index-width", 1}}));
  Written padded;
  padded.padding = 2;
  EXPECT_TRUE(read(padded).readable);
  EXPECT_EQ(read(padded).found, (Found{{"tile.padding", 1}}));
}

TEST(CheckDecode, Above65536VerticesIndicesAre32BitWideAndPadded) {
  for (const std::size_t count : {65535u, 65536u, 65537u, 65538u}) {
    Written tile;
    for (Codes& one : tile.coordinates) one.assign(count, 0);
    tile.index_size = count > 65536 ? 4 : 2;
    tile.padding = count > 65536 && count % 2 == 1 ? 2 : 0;
    EXPECT_EQ(read(tile).found, Found{}) << count;
    EXPECT_EQ(read(tile).tile.u.size(), count);
    if (count <= 65536) continue;
    tile.padding = 2 - tile.padding;
    EXPECT_EQ(read(tile).found, (Found{{"tile.padding", 1}})) << count;
  }
}

TEST(CheckDecode, ExtensionsAreReadAndWhatIsWrongWithThemFound) {
  Written tile;
  tile.extend(1, {1, 2, 3, 4, 5, 6, 7, 8});
  tile.extend(2, {255});
  tile.extend(4, {3, 0, 0, 0, '{', ' ', '}'});
  Read got = read(tile);
  EXPECT_EQ(got.found, Found{});
  EXPECT_EQ(got.tile.normals,
            (std::vector<std::array<std::uint8_t, 2>>{{1, 2}, {3, 4}, {5, 6}, {7, 8}}));
  EXPECT_EQ(got.tile.water_mask, (std::vector<std::uint8_t>{255}));
  EXPECT_EQ(got.tile.metadata, "{ }");

  const auto with = [](std::uint8_t id, const std::vector<std::uint8_t>& body) {
    Written one;
    one.extend(id, body);
    return read(one).found;
  };
  EXPECT_EQ(with(1, {1, 2, 3, 4, 5, 6, 7}), (Found{{"ext.normals", 1}}));
  EXPECT_EQ(with(1, {1, 2, 3, 4, 5, 6, 7, 8, 9}), (Found{{"ext.normals", 1}}));
  EXPECT_EQ(with(2, {}), (Found{{"ext.water-mask", 1}}));
  EXPECT_EQ(with(2, {1, 2}), (Found{{"ext.water-mask", 1}}));
  EXPECT_EQ(with(2, std::vector<std::uint8_t>(65536)), Found{});
  EXPECT_EQ(with(2, std::vector<std::uint8_t>(65535)), (Found{{"ext.water-mask", 1}}));
  EXPECT_EQ(with(4, {0, 0, 0}), (Found{{"ext.metadata", 1}}));
  EXPECT_EQ(with(4, {0, 0, 0, 0}), Found{});
  EXPECT_EQ(with(4, {1, 0, 0, 0}), (Found{{"ext.metadata", 1}}));
  EXPECT_EQ(with(4, {1, 0, 0, 0, '{', '}'}), (Found{{"ext.metadata", 1}}));
  EXPECT_EQ(with(3, {9}), (Found{{"ext.unknown", 1}}));

  Written thrice;
  for (int i = 0; i < 3; ++i) thrice.extend(2, {std::uint8_t(i)});
  EXPECT_EQ(read(thrice).found, (Found{{"ext.duplicate", 1}})) << "told once";
}

TEST(CheckDecode, LengthsInTheOtherByteOrderAreSeenForWhatTheyAre) {
  const std::vector<std::uint8_t> large(0x00010203, 7);  // of another length whichever way read
  Written tile;
  tile.extend(2, {1}, true);
  tile.extend(9, large, true);
  const Read got = read(tile);
  EXPECT_EQ(got.found, (Found{{"ext.big-endian", 1}, {"ext.unknown", 1}}));
  EXPECT_EQ(got.tile.water_mask, (std::vector<std::uint8_t>{1}));
  Written cut;
  cut.extend(9, large, true);
  std::vector<std::uint8_t> bytes = cut.bytes();
  EXPECT_EQ(read(bytes).found, (Found{{"ext.big-endian", 1}, {"ext.unknown", 1}}));
  bytes.pop_back();
  EXPECT_EQ(read(bytes).found, (Found{{"tile.truncated", 1}}));
}

}  // namespace
}  // namespace tind
