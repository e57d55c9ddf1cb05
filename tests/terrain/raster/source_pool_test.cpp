// Sources that share what is open and what is decoded.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

constexpr int kSide = 20;

/// A grid whose posts all have this height.
std::string flat(const test::TempDir& folder, int number, int height) {
  const std::string path = folder.file(std::to_string(number) + ".asc");
  std::ofstream out(path);
  out << "ncols " << kSide << "\nnrows " << kSide
      << "\nxllcenter 10\nyllcenter 46\ncellsize 0.01\nNODATA_value -9999\n";
  for (int i = 0; i < kSide * kSide; ++i) out << height << ' ';
  return path;
}

std::size_t open_files() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return std::size_t(std::distance(begin(all), end(all)));
}

TEST(SourcePool, HasOneBoundForAllAndMixesNothing) {
  const test::TempDir folder;
  const auto pool =
      SourcePool::make({.heights_bytes = 3 * kSide * kSide * sizeof(float), .open_files = 4});
  std::vector<std::shared_ptr<const DemSource>> sources(30);
  (void)DemSource::open(std::vector{flat(folder, 0, 0)});  // PROJ keeps its database open
  const std::size_t before = open_files();
  int number = 0;
  // The second round's files come to lie where the first one's were, in memory.
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if (round > 0 && i % 2 == 0) continue;
      sources[i] = nullptr;
      ++number;
      auto opened = DemSource::open(std::vector{flat(folder, number, number)}, {.pool = pool});
      ASSERT_TRUE(opened) << opened.error().what;
      sources[i] = std::move(*opened);
    }
    for (int again = 0; again < 2; ++again)
      for (const auto& source : sources) {
        const auto heights = source->read(0, 0, kSide, kSide);
        ASSERT_TRUE(heights) << heights.error().what;
        const std::string stem = std::filesystem::path(source->info().files[0]).stem();
        for (const float z : heights->values()) ASSERT_EQ(z, float(std::stoi(stem)));
      }
    EXPECT_LE(open_files(), before + 4) << "in round " << round;
  }
}

TEST(SourcePool, ASourceSaysWhetherItsFilesAreAsTheyWere) {
  const test::TempDir folder;
  const std::string path = flat(folder, 1, 5);
  const auto source = DemSource::open(std::vector{path});
  ASSERT_TRUE(source) << source.error().what;
  EXPECT_TRUE((*source)->unchanged());
  std::filesystem::rename(path, path + ".away");
  const auto gone = (*source)->unchanged();
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, Errc::io);
  EXPECT_NE(gone.error().what.find(path), std::string::npos);
  std::filesystem::rename(path + ".away", path);
  EXPECT_TRUE((*source)->unchanged());
  flat(folder, 1, 6);
  EXPECT_FALSE((*source)->unchanged());
}

}  // namespace
}  // namespace tind
