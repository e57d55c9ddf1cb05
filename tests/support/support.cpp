#include "tests/support/support.h"

#include <unistd.h>

#include <cmath>
#include <random>
#include <sstream>

namespace tind::test {

HeightGrid grid_from(const std::string& drawing) {
  std::vector<std::vector<float>> rows(1);
  std::istringstream in(drawing);
  for (std::string word; in >> word;) {
    if (word == "/")
      rows.emplace_back();
    else
      rows.back().push_back(word == "." ? HeightGrid::kVoid : std::stof(word));
  }
  HeightGrid grid(int(rows[0].size()), int(rows.size()));
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c) grid.at(c, r) = rows[r].at(c);
  return grid;
}

HeightGrid rough_terrain(int cols, int rows, unsigned seed, float relief) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> phase(0, 6.283185307179586), turn(-1, 1);
  HeightGrid grid(cols, rows, 0);
  double amplitude = relief / 4;
  for (double wave = 90; wave > 2; wave /= 1.9, amplitude /= 1.75) {
    for (int k = 0; k < 4; ++k) {
      const double a = phase(random), b = phase(random), t = turn(random);
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < cols; ++c)
          grid.at(c, r) += float(amplitude / 2 * std::sin(a + 6.283 * (c + t * r) / wave) *
                                 std::cos(b + 6.283 * (r - t * c) / wave));
    }
  }
  for (float& z : grid.values()) z += relief / 2;
  return grid;
}

std::string testdata(const std::string& name) { return std::string(TIND_TESTDATA) + "/" + name; }

std::string shared_data(const std::string& name) {
  const std::string path = std::string(TIND_SHARED_DATA) + "/" + name;
  return std::filesystem::exists(path) ? path : std::string();
}

TempDir::TempDir() {
  std::string pattern = (std::filesystem::temp_directory_path() / "tind-test-XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}

TempDir::~TempDir() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace tind::test
