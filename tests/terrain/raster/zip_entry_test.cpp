#include "terrain/raster/gdal/heights/zip_entry.h"

#include <gtest/gtest.h>

#include "tests/support/support.h"

namespace tind {
namespace {

std::string seed(const std::string& name) { return test::testdata("fuzz/zip_entry_fuzz/" + name); }

TEST(ZipEntry, StoredAndDeflated) {
  const auto stored = read_zip_entry(seed("stored"), {".hgt"}, 1000);
  const auto deflated = read_zip_entry(seed("deflated"), {".hgt"}, 1000);
  ASSERT_TRUE(stored && deflated);
  EXPECT_EQ(stored->name, "N41E001.hgt");
  ASSERT_EQ(stored->bytes.size(), 400u);
  for (int i = 0; i < 400; ++i) EXPECT_EQ(stored->bytes[i], i % 200);
  EXPECT_EQ(stored->bytes, deflated->bytes);
}

TEST(ZipEntry, TheOneWithTheSuffixInEitherCase) {
  const auto entry = read_zip_entry(seed("two"), {".hgt"}, 2000);
  ASSERT_TRUE(entry) << entry.error().what;
  EXPECT_EQ(entry->name, "d/N41E001.HGT");
  EXPECT_EQ(entry->bytes, std::vector<std::uint8_t>(2000, 0));
}

TEST(ZipEntry, BoundsAndAbsence) {
  EXPECT_EQ(read_zip_entry(seed("two"), {".hgt"}, 1999).error().code, Errc::out_of_range);
  EXPECT_EQ(read_zip_entry(seed("two"), {".tif"}, 2000).error().code, Errc::unsupported);
  EXPECT_EQ(read_zip_entry(seed("none"), {".hgt"}, 2000).error().code, Errc::not_found);
  EXPECT_EQ(read_zip_entry(test::testdata("crater.tif"), {".hgt"}, 1 << 20).error().code,
            Errc::bad_data);
}

}  // namespace
}  // namespace tind
