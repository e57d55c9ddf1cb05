// Numbers, header and directories of PMTiles, there and back; and what is damaged is refused.

#include "proto/tile/pmtiles.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "terrain/base/deflate.h"

namespace tind::proto {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(Pmtiles, TheFirstNumbersAreThoseOfTheFormat) {
  // As the specification lists them.
  const PmtilesPlace places[] = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}, {2, 0, 0}};
  for (std::uint64_t number = 0; number < std::size(places); ++number) {
    EXPECT_EQ(pmtiles_number(places[number]), number);
    EXPECT_EQ(pmtiles_place(number), places[number]);
  }
  EXPECT_EQ(pmtiles_number({12, 3423, 1763}), 19078479u);
}

TEST(Pmtiles, NumbersComeBackAndNeighboursInNumberAreNeighboursInPlace) {
  PmtilesPlace before{5, 0, 0};
  for (std::uint64_t number = 341; number < 1365; ++number) {  // zoom 5
    const auto place = pmtiles_place(number);
    ASSERT_TRUE(place);
    ASSERT_EQ(place->zoom, 5);
    ASSERT_EQ(pmtiles_number(*place), number);
    const auto far = [](std::uint32_t a, std::uint32_t b) { return a > b ? a - b : b - a; };
    if (number > 341) {
      ASSERT_EQ(far(place->x, before.x) + far(place->y, before.y), 1u);
    }
    before = *place;
  }
  const PmtilesPlace last{kPmtilesDeepest, (1u << kPmtilesDeepest) - 1, 0};
  EXPECT_EQ(pmtiles_place(pmtiles_number(last)), last);
  EXPECT_FALSE(pmtiles_place(pmtiles_number(last) + 1));
}

PmtilesHeader header() {
  PmtilesHeader h;
  h.root = {127, 1}, h.metadata = {128, 2}, h.leaves = {130, 3}, h.tiles = {133, 4};
  h.addressed = 5, h.entries = 6, h.contents = 7;
  h.clustered = true;
  h.tiles_are = PmtilesPacking::none;
  h.tile_type = 8, h.min_zoom = 9, h.max_zoom = 10, h.centre_zoom = 11;
  h.west = -12, h.south = -13, h.east = 14, h.north = 15, h.centre_lon = 16, h.centre_lat = -17;
  return h;
}

TEST(Pmtiles, AHeaderComesBackAndIs127Bytes) {
  const std::string bytes = encode_pmtiles_header(header());
  EXPECT_EQ(bytes.size(), kPmtilesHeaderBytes);
  EXPECT_EQ(bytes.substr(0, 9), "PMTiles\x03\x7f");
  const auto back = decode_pmtiles_header(bytes_of(bytes));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, header());
}

TEST(Pmtiles, HeadersThatSayTooMuchAreRefused) {
  const std::string good = encode_pmtiles_header(header());
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(decode_pmtiles_header(bytes_of(good.substr(0, size)))) << size;
  std::string other = good;
  other[7] = 2;
  EXPECT_EQ(decode_pmtiles_header(bytes_of(other)).error().code, Errc::unsupported);
  PmtilesHeader h = header();
  h.tiles = {133, ~std::uint64_t(0) - 100};  // ends behind the last number
  EXPECT_EQ(decode_pmtiles_header(bytes_of(encode_pmtiles_header(h))).error().code, Errc::bad_data);
}

TEST(Pmtiles, TheLastOfEachNumberOfTheHeaderIsRead) {
  PmtilesHeader h = header();
  h.tiles = {133, ~std::uint64_t(0) - 133};
  h.directories_are = h.tiles_are = PmtilesPacking::zstd;
  const std::string good = encode_pmtiles_header(h);
  const auto back = decode_pmtiles_header(bytes_of(good));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, h);
  for (const auto& [at, beyond] : {std::pair(96, 2), std::pair(97, 5), std::pair(98, 5)}) {
    std::string bytes = good;
    bytes[std::size_t(at)] = char(beyond);
    EXPECT_FALSE(decode_pmtiles_header(bytes_of(bytes))) << at;
  }
}

std::vector<PmtilesEntry> entries(std::size_t count) {
  std::vector<PmtilesEntry> all;
  std::uint64_t at = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto size = std::uint32_t(1 + k * 7919 % 5000);
    all.push_back({10 + 3 * k, at, size, 1});
    at += size;
  }
  return all;
}

TEST(Pmtiles, ADirectoryComesBack) {
  std::vector<PmtilesEntry> all = entries(100);
  all[50].at = 7, all[60].run = 0, all[70].run = 9;
  const auto back = decode_pmtiles_directory(bytes_of(encode_pmtiles_directory(all)));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, all);
}

TEST(Pmtiles, ATileBehindTheOneBeforeItHasNoPlaceOfItsOwn) {
  const PmtilesEntry some[] = {{1, 5, 5, 1}, {2, 10, 6, 1}, {4, 4, 7, 1}};
  // Count, steps, runs, sizes, places plus one; 4 is where the second begins less its size.
  const char bytes[] = {3, 1, 1, 2, 1, 1, 1, 5, 6, 7, 6, 0, 5};
  EXPECT_EQ(encode_pmtiles_directory(some), std::string(bytes, sizeof bytes));
}

TEST(Pmtiles, TheLastOfEachNumberOfADirectoryIsRead) {
  const auto reads = [](std::vector<PmtilesEntry> some) {
    const auto back = decode_pmtiles_directory(bytes_of(encode_pmtiles_directory(some)));
    return back && *back == some;
  };
  constexpr std::uint64_t kEnd = std::uint64_t(1) << 62;
  EXPECT_TRUE(reads({{0, 0, 1, 1}}));
  EXPECT_TRUE(reads({{kEnd - 1, 0, 1, 1}}));
  EXPECT_FALSE(reads({{kEnd, 0, 1, 1}}));
  EXPECT_TRUE(reads({{kEnd / 2, 0, 1, 1}, {kEnd - 1, 1, 1, 1}}));
  EXPECT_FALSE(reads({{kEnd / 2, 0, 1, 1}, {kEnd, 1, 1, 1}}));
  EXPECT_FALSE(reads({{7, 0, 1, 1}, {7, 1, 1, 1}}));
  EXPECT_TRUE(reads({{0, kEnd - 1, 1, 1}}));
  EXPECT_FALSE(reads({{0, kEnd, 1, 1}}));
  EXPECT_FALSE(reads({{0, kEnd - 1, 1, 1}, {1, kEnd, 1, 1}}));
  constexpr std::uint32_t kLargest = (1u << 28) - 1;
  EXPECT_TRUE(reads({{0, 0, kLargest, kLargest}}));
  EXPECT_FALSE(reads({{0, 0, kLargest + 1, 1}}));
  EXPECT_FALSE(reads({{0, 0, 1, kLargest + 1}}));
}

TEST(Pmtiles, DamagedDirectoriesAreRefused) {
  const std::string good = encode_pmtiles_directory(entries(20));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(decode_pmtiles_directory(bytes_of(good.substr(0, size)))) << size;
  EXPECT_FALSE(decode_pmtiles_directory(bytes_of(good + "x")));
  auto twice = entries(20);
  twice[3].number = twice[2].number;
  EXPECT_FALSE(decode_pmtiles_directory(bytes_of(encode_pmtiles_directory(twice))));
  auto empty = entries(20);
  empty[3].size = 0;
  EXPECT_FALSE(decode_pmtiles_directory(bytes_of(encode_pmtiles_directory(empty))));
  EXPECT_FALSE(decode_pmtiles_directory(bytes_of("\xff\xff\xff\xff\xff\x7f")));  // so many entries
}

TEST(Pmtiles, ManyTilesGoIntoLeavesAndTheRootFitsBehindTheHeader) {
  for (const std::size_t count : {10u, 100'000u, 25 * 4096u}) {
    const auto all = entries(count);
    const auto made = pmtiles_directories(all);
    EXPECT_LE(made.root.size(), kPmtilesFirstBytes - kPmtilesHeaderBytes);
    EXPECT_EQ(made.leaf_entries, count == 10 ? 0u : 4096u);
    EXPECT_EQ(made.leaves.empty(), count == 10);
    const auto root = decode_pmtiles_directory(*gunzip(made.root, 1 << 20));
    ASSERT_TRUE(root);
    std::vector<PmtilesEntry> found = count == 10 ? *root : std::vector<PmtilesEntry>();
    if (count > 10)
      for (const PmtilesEntry& leaf : *root) {
        EXPECT_EQ(leaf.run, 0u);
        const auto inside = decode_pmtiles_directory(
            *gunzip(made.leaves.substr(std::size_t(leaf.at), leaf.size), 1 << 24));
        ASSERT_TRUE(inside);
        EXPECT_EQ(inside->front().number, leaf.number);
        found.insert(found.end(), inside->begin(), inside->end());
      }
    EXPECT_EQ(found, all);
  }
}

TEST(Pmtiles, ThereAreLeavesOnlyWhereTheTilesDoNotFitIntoTheRoot) {
  constexpr std::size_t kRoom = kPmtilesFirstBytes - kPmtilesHeaderBytes;
  std::mt19937 random(1);  // sizes that do not pack well
  std::vector<PmtilesEntry> all;
  for (std::uint64_t k = 0, at = 0; k < 20'000; ++k) {
    all.push_back({k, at, std::uint32_t(1 + random() % 100'000), 1});
    at += all.back().size;
  }
  std::size_t fits = 1000, fits_not = all.size();  // bisected
  while (fits_not - fits > 1) {
    const std::size_t count = (fits + fits_not) / 2;
    const auto some = std::span(all).first(count);
    const bool whole = pmtiles_directories(some).leaf_entries == 0;
    const auto packed =
        deflate<std::string>(encode_pmtiles_directory(some), Wrapping::gzip, 10).size();
    EXPECT_EQ(whole, packed <= kRoom) << count;
    (whole ? fits : fits_not) = count;
  }
  EXPECT_GT(pmtiles_directories(std::span(all).first(fits)).root.size(), kRoom - 10);
}

}  // namespace
}  // namespace tind::proto
