#include "terrain/check/subtree.h"

#include <gtest/gtest.h>

#include <string>

#include "proto/tile/tiles3d.h"

namespace tind {
namespace {

void put(std::string& bytes, std::uint64_t number, int size) {
  for (int i = 0; i < size; ++i) bytes += char(number >> 8 * i & 255);
}

std::string subtree_of(const std::string& json, const std::string& buffer = {}) {
  std::string bytes = "subt";
  put(bytes, 1, 4);
  put(bytes, json.size(), 8);
  put(bytes, buffer.size(), 8);
  return bytes + json + buffer;
}

/// Tiles as said, and no subtree below.
std::string with_tiles(const std::string& said, const std::string& views,
                       const std::string& buffer) {
  return subtree_of(R"({"bufferViews":)" + views + R"(,"tileAvailability":)" + said +
                        R"(,"childSubtreeAvailability":{"constant":0}})",
                    buffer);
}

TEST(ReadSubtree, HasTheBitsThatTindWrites) {
  proto::Subtree written;
  written.tiles.resize(tiles_in_subtree(2));
  for (const std::size_t i : {0u, 2u, 3u}) written.tiles[i].emplace();
  written.children.resize(16);
  written.children[9] = true;
  const auto bytes = encode(written);
  const auto read = read_subtree({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, 2);
  ASSERT_TRUE(read) << read.error().what;
  for (std::size_t i = 0; i < written.tiles.size(); ++i) {
    EXPECT_EQ(read->tiles.at(i), written.tiles[i].has_value()) << i;
    EXPECT_EQ(read->contents.at(i), written.tiles[i].has_value()) << i;
  }
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(read->children.at(i), i == 9) << i;
}

TEST(ReadSubtree, IsOfMortonNumbers) {
  EXPECT_EQ(subtree_morton(1, 0), 1u);
  EXPECT_EQ(subtree_morton(0, 1), 2u);
  EXPECT_EQ(subtree_morton(3, 5), 0b100111u);
  EXPECT_EQ(subtree_morton(0xffffffff, 0xffffffff), ~std::uint64_t(0));
  EXPECT_EQ(tiles_in_subtree(1), 1u);
  EXPECT_EQ(tiles_in_subtree(3), 21u);
}

TEST(ReadSubtree, TakesConstantsAndContentsThatAreNotSaid) {
  const std::string bytes = subtree_of(
      R"({"tileAvailability":{"constant":1},"childSubtreeAvailability":{"constant":0}})");
  const auto read = read_subtree(bytes, kMostSubtreeLevels);
  ASSERT_TRUE(read) << read.error().what;
  const std::uint64_t last = tiles_in_subtree(kMostSubtreeLevels) - 1;
  EXPECT_TRUE(read->tiles.at(last));
  EXPECT_FALSE(read->contents.at(last));
  EXPECT_FALSE(read->children.at(0));
}

TEST(ReadSubtree, RefusesBitsBeyondItsBytes) {
  const std::string said = R"({"bitstream":0})", buffer(3, '\xff');
  const std::string views = R"([{"buffer":0,"byteOffset":1,"byteLength":2}])";
  EXPECT_TRUE(read_subtree(with_tiles(said, views, buffer), 2));
  for (const std::string& wrong :
       {with_tiles(said, views, buffer.substr(1)),          // ends before its last byte
        with_tiles(said, R"([{"byteLength":0}])", buffer),  // of no byte
        with_tiles(said, R"([{"byteOffset":1}])", buffer),  // of no length
        with_tiles(said, R"([{"byteOffset":-1,"byteLength":2}])", buffer),
        with_tiles(said, R"([{"byteOffset":9223372036854775807,"byteLength":2}])", buffer),
        with_tiles(said, R"([{"byteLength":18446744073709551615}])", buffer),
        with_tiles(said, "[7]", buffer), with_tiles(said, "{}", buffer),
        with_tiles(R"({"bitstream":1})", views, buffer),  // a view that is not there
        with_tiles(R"({"constant":2})", views, buffer), with_tiles("1", views, buffer)}) {
    const auto read = read_subtree(wrong, 2);
    ASSERT_FALSE(read) << wrong;
    EXPECT_EQ(read.error().code, Errc::bad_data);
    EXPECT_EQ(read.error().what, "does not say which tiles there are") << wrong;
  }
  // 21 tiles of three levels take three bytes.
  EXPECT_FALSE(read_subtree(with_tiles(said, views, buffer), 3));
}

TEST(ReadSubtree, RefusesWhatIsNone) {
  const std::string good = subtree_of(
      R"({"tileAvailability":{"constant":1},"childSubtreeAvailability":{"constant":0}})");
  const auto what = [](const std::string& bytes) {
    const auto read = read_subtree(bytes, 1);
    return read ? "" : read.error().what;
  };
  EXPECT_EQ(what(good), "");
  EXPECT_EQ(what(good.substr(0, 23)), "is no subtree");
  EXPECT_EQ(what("t" + good), "is no subtree");
  EXPECT_EQ(what(good + "x"), "has another length than it says");
  EXPECT_EQ(what(good.substr(0, good.size() - 1)), "has another length than it says");
  std::string huge = good;
  huge.replace(8, 8, 8, '\xff');  // + 24 would wrap around
  EXPECT_EQ(what(huge), "has another length than it says");
  std::string second = good;
  second[4] = 2;
  EXPECT_EQ(what(second), "is not of version 1");
  EXPECT_EQ(what(subtree_of("[]")), "its JSON is damaged");
  EXPECT_EQ(what(subtree_of("{")), "its JSON is damaged");
  EXPECT_EQ(what(subtree_of(R"({"tileAvailability":{"constant":1}})")),
            "does not say which subtrees follow");
  EXPECT_EQ(what(subtree_of(R"({"tileAvailability":{"constant":1},"contentAvailability":[3],)"
                            R"("childSubtreeAvailability":{"constant":0}})")),
            "does not say which contents there are");
}

}  // namespace
}  // namespace tind
