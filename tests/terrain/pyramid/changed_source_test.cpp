// A DEM that changes while tiles are built of it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>

#include "terrain/pyramid/build/build.h"
#include "tests/support/srtm.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

std::string hills(int lift) {
  return test::srtm(
      [=](int c, int r) { return 500 + lift + (c * 7 + r * 3) % 200 + c * r / 3000; });
}

Result<BuildReport> build(const std::string& dem, const std::string& output,
                          const Progress& progress = {}) {
  // Of the heights one block is kept, so that tiles are made of what is in the file now.
  auto source = DemSource::open({&dem, 1}, {.cache_bytes = 1});
  if (!source) return std::unexpected(source.error());
  BuildOptions options;
  options.tiles.max_level = 10;
  options.tiles.max_error_m = 40;
  options.output = output;
  options.threads = 2;
  return build_tiles(*source, options, progress);
}

std::map<std::string, std::string> tiles_in(const std::string& folder) {
  std::map<std::string, std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".terrain") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    found[fs::relative(entry.path(), folder).string()] = {std::istreambuf_iterator<char>(in), {}};
  }
  return found;
}

TEST(ChangedSource, ABuildStopsAndLeavesWhatIsRight) {
  const test::TempDir folder;
  fs::create_directory(folder.file("a"));
  fs::create_directory(folder.file("b"));
  const std::string dem = folder.file("a/N46E007.hgt"), other = folder.file("b/N46E007.hgt");
  test::write_bytes(dem, hills(0));
  ASSERT_TRUE(build(dem, folder.file("old")));
  test::write_bytes(other, hills(100));
  ASSERT_TRUE(build(other, folder.file("new")));

  std::atomic<bool> changed = false;
  Progress progress;
  progress.report = [&](double share) {
    if (share > 0.5 && !changed.exchange(true)) test::overwrite_bytes(dem, hills(100));
  };
  const auto stopped = build(dem, folder.file("out"), progress);
  ASSERT_TRUE(changed);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::io);
  EXPECT_THAT(stopped.error().what, AllOf(HasSubstr(dem), HasSubstr("was written to")));
  EXPECT_FALSE(fs::exists(folder.file("out/layer.json")));
  const auto old_tiles = tiles_in(folder.file("old")), left = tiles_in(folder.file("out"));
  EXPECT_GT(left.size(), 2u);
  EXPECT_LT(left.size(), old_tiles.size());
  for (const auto& [name, bytes] : left) EXPECT_EQ(bytes, old_tiles.at(name)) << name;

  // Run again, it makes what is in the file now.
  const auto again = build(dem, folder.file("out"));
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(tiles_in(folder.file("out")), tiles_in(folder.file("new")));
}

}  // namespace
}  // namespace tind
