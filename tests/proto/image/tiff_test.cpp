// Whole is what has all that its directory names; read back what GDAL writes in
// terrain/heightmaps/cdb_test.cpp.

#include "proto/image/tiff.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

struct Entry {
  std::uint16_t tag, type;
  std::uint32_t count, value;
};

template <class T>
void add(std::string& out, T value) {
  char bytes[sizeof(T)];
  store(value, bytes);
  out.append(bytes, sizeof bytes);
}

/// A directory at 8, and so many bytes behind it.
std::string tiff(const std::vector<Entry>& entries, std::size_t rest) {
  std::string out("II*\0", 4);
  add<std::uint32_t>(out, 8);
  add<std::uint16_t>(out, std::uint16_t(entries.size()));
  for (const Entry& e : entries) {
    add(out, e.tag), add(out, e.type);
    add(out, e.count), add(out, e.value);
  }
  add<std::uint32_t>(out, 0);
  return out + std::string(rest, '\0');
}

constexpr std::uint32_t kEnd = 8 + 2 + 2 * 12 + 4;  // of a directory of two

TEST(Tiff, WithAllItsPartsIsWholeAndCutOffAnywhereIsNot) {
  const std::string strip = tiff({{273, 4, 1, kEnd}, {279, 3, 1, 50}}, 50);
  const std::string tile = tiff({{324, 4, 1, kEnd}, {325, 4, 1, 50}}, 50);
  for (const std::string& whole : {strip, tile}) {
    EXPECT_TRUE(is_whole_tiff(whole));
    EXPECT_TRUE(is_whole_tiff(whole + "x"));
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(is_whole_tiff(std::string(whole, 0, size))) << size;
  }
}

TEST(Tiff, ManyStripsLieWhereTheListsSay) {
  std::string lists;
  for (const std::uint32_t offset : {kEnd + 16, kEnd + 20}) add(lists, offset);
  for (const std::uint32_t size : {4u, 6u}) add(lists, size);
  const std::string whole =
      tiff({{273, 4, 2, kEnd}, {279, 4, 2, kEnd + 8}}, 0) + lists + std::string(10, 'x');
  EXPECT_TRUE(is_whole_tiff(whole));
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(is_whole_tiff(std::string(whole, 0, size))) << size;
}

TEST(Tiff, NumbersThatLeadBeyondItAreNotFollowed) {
  const std::uint32_t most = 0xffffffff;
  for (const auto& entries : std::vector<std::vector<Entry>>{
           {{273, 4, 1, most}, {279, 4, 1, most}},        // ends beyond 2^32
           {{273, 4, most, kEnd}, {279, 4, most, kEnd}},  // more numbers than bytes
           {{273, 12, most, most}, {279, 4, 1, 1}},
           {{273, 99, 1, kEnd}, {279, 4, 1, 1}},  // no such type
           {{273, 5, 1, kEnd}, {279, 4, 1, 1}},   // no whole number
           {{273, 4, 0, 0}, {279, 4, 0, 0}},      // of nothing
           {{273, 4, 1, kEnd}, {279, 3, 2, 1}},   // two sizes of one strip
           {{273, 4, 1, kEnd}, {273, 4, 1, kEnd}},
           {{256, 4, 1, 1}, {257, 4, 1, 1}}})
    EXPECT_FALSE(is_whole_tiff(tiff(entries, 50)));
  EXPECT_FALSE(is_whole_tiff(""));
  EXPECT_FALSE(is_whole_tiff(std::string("II*\0\xff\xff\xff\xff", 8)));
  EXPECT_FALSE(is_whole_tiff(std::string(100, '\0')));
}

}  // namespace
}  // namespace tind::proto
