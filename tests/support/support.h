#pragma once
// What several tests need: small worlds drawn as text, the data folders, temporary folders.

#include <filesystem>
#include <functional>
#include <string>

#include "terrain/raster/height_grid.h"

namespace tind::test {

/// "0 0 9 / 0 5 0 / 1 . 2": rows from north to south; '.' is a void.
HeightGrid grid_from(const std::string& drawing);

/// A rough, seeded random terrain (sum of octaves), heights about 0..relief.
HeightGrid rough_terrain(int cols, int rows, unsigned seed, float relief = 500);

/// testdata/NAME of this repository.
std::string testdata(const std::string& name);

/// The large data set beside the repository, or empty when it is not there (skip the test then:
/// TIND_NEEDS_SHARED_DATA).
std::string shared_data(const std::string& name);

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
