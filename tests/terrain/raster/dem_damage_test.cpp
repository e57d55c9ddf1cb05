// Damaged and hostile files: an error, or the very same heights; never silently other ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <random>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::HasSubstr;

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

Result<HeightGrid> read_all(const std::string& path, const DemOptions& options = {}) {
  auto source = DemSource::open({&path, 1}, options);
  if (!source) return std::unexpected(source.error());
  return (*source)->read(0, 0, int((*source)->info().cols), int((*source)->info().rows));
}

bool same(const HeightGrid& a, const HeightGrid& b) {
  return a.cols() == b.cols() && a.rows() == b.rows() &&
         std::memcmp(a.values().data(), b.values().data(), a.size() * sizeof(float)) == 0;
}

/// Cuts the file at many places; returns how many of the cuts were noticed.
int notices_cuts(const std::string& path, const std::string& name, int step) {
  const test::TempDir folder;
  const auto truth = read_all(path);
  EXPECT_TRUE(truth.has_value()) << truth.error().what;
  const std::string bytes = bytes_of(path), cut = folder.file(name);
  int noticed = 0;
  for (std::size_t size = 0; size < bytes.size(); size += size + 12 < bytes.size() ? step : 1) {
    if (size + 12 < bytes.size() && size + step >= bytes.size()) size = bytes.size() - 12;
    write(cut, bytes.substr(0, size));
    const auto got = read_all(cut);
    if (!got) {
      ++noticed;
      EXPECT_THAT(got.error().what, HasSubstr(name));
    } else if (!std::isdigit(bytes[size - 1])) {  // text cut inside its last number is no less text
      EXPECT_TRUE(same(*got, *truth)) << name << " cut to " << size << " of " << bytes.size();
    }
  }
  return noticed;
}

TEST(DemDamage, TruncatedFilesAreErrors) {
  EXPECT_GE(notices_cuts(test::testdata("rainier.tif"), "rainier.tif", 9001), 25);
  EXPECT_GE(notices_cuts(test::testdata("bigtujunga_crop.tif"), "cut.tif", 907), 30);
  EXPECT_GE(notices_cuts(test::testdata("crater.tif"), "cut.tif", 2997), 25);
  EXPECT_GE(notices_cuts(test::testdata("desert.asc"), "desert.asc", 401), 30);
}

TEST(DemDamage, TruncatedSharedFilesAreErrors) {
  TIND_NEEDS_SHARED_DATA(hgt, "dem/N52E008.hgt.zip");
  EXPECT_GE(notices_cuts(hgt, "N52E008.hgt.zip", 60013), 14);
  EXPECT_GE(notices_cuts(test::shared_data("dem/n33_w116_3arc_v2.dt1"), "n.dt1", 300007), 9);
  EXPECT_GE(notices_cuts(test::shared_data("dem/SainteHelens.dem"), "s.dem", 60013), 16);
  EXPECT_GE(notices_cuts(test::shared_data("dem/ps_height_1k.png"), "p.png", 100003), 14);
  EXPECT_GE(notices_cuts(test::shared_data("dem/westUS.tif"), "w.tif", 50021), 17);
  EXPECT_GE(notices_cuts(test::shared_data("dem/N49W123.tif"), "n.tif", 200003), 14);
}

TEST(DemDamage, WordsInAnAsciiGridAreErrors) {
  const test::TempDir folder;
  std::string text = bytes_of(test::testdata("desert.asc"));
  text[text.size() / 2] = 'x';
  write(folder.file("d.asc"), text);
  const auto got = read_all(folder.file("d.asc"));
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error().what, HasSubstr("no number"));
}

/// Flips one bit at a time; every result must be an error or the truth. Returns the errors.
int notices_flips(const std::string& path, const std::string& name, int flips, double from = 0) {
  const test::TempDir folder;
  const auto truth = read_all(path);
  EXPECT_TRUE(truth.has_value());
  std::string bytes = bytes_of(path);
  std::mt19937 random(7);
  int noticed = 0;
  for (int k = 0; k < flips; ++k) {
    const auto first = std::size_t(from * double(bytes.size()));
    const std::size_t at = first + random() % (bytes.size() - first);
    const char mask = char(1 << random() % 8);
    bytes[at] ^= mask;
    const std::string flipped = folder.file(name);
    write(flipped, bytes);
    const auto got = read_all(flipped);
    if (!got)
      ++noticed;
    else
      EXPECT_TRUE(same(*got, *truth)) << name << " bit " << int(mask) << " of byte " << at;
    bytes[at] ^= mask;
  }
  return noticed;
}

TEST(DemDamage, FlippedBitsInCompressedDataAreErrors) {
  EXPECT_GE(notices_flips(test::testdata("rainier.tif"), "r.tif", 400, 0.02), 390);
  TIND_NEEDS_SHARED_DATA(hgt, "dem/N52E008.hgt.zip");
  EXPECT_GE(notices_flips(hgt, "N52E008.hgt.zip", 60, 0.01), 55);
  EXPECT_GE(notices_flips(test::shared_data("dem/ps_height_1k.png"), "p.png", 60, 0.001), 55);
}

}  // namespace
}  // namespace tind
