#pragma once
// What several tests need: small worlds drawn as text, the data folders, temporary folders.

#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include "terrain/geo/environment.h"
#include "terrain/raster/height_grid.h"

namespace tind::test {

/// Sanitizers multiply what a program takes, in time and memory: less of the same is enough there,
/// and figures say nothing.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

/// "0 0 9 / 0 5 0 / 1 . 2": rows from north to south; '.' is a void.
HeightGrid grid_from(const std::string& drawing);

/// A rough, seeded random terrain (sum of octaves), heights about 0..relief.
HeightGrid rough_terrain(int cols, int rows, unsigned seed, float relief = 500);

/// A grid of up to 31 x 31 posts: noise, or in every third round cliffs; with voids in
/// every fourth.
HeightGrid awkward_grid(std::mt19937& random, int round);
/// A grid of up to `sides` + 1 posts a side of few different heights (0, `step`, ...), one post in
/// `void_in` without; never wholly void.
HeightGrid terraced_grid(std::mt19937& random, unsigned sides, unsigned void_in, unsigned heights,
                         int step);

/// testdata/NAME of this repository.
std::string testdata(const std::string& name);

/// The large data set beside the repository, or empty when it is not there (skip the test then:
/// TIND_NEEDS_SHARED_DATA).
std::string shared_data(const std::string& name);

/// Of the build tree: the geoid that programs find beside them.
std::shared_ptr<const Environment> environment();

/// A fresh folder, removed with the object.
class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace tind::test

#define TIND_NEEDS_SHARED_DATA(variable, name)                \
  const std::string variable = tind::test::shared_data(name); \
  if (variable.empty()) GTEST_SKIP() << "needs ../shared/data/" << (name)
