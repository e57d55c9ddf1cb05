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

HeightGrid awkward_grid(std::mt19937& random, int round) {
  HeightGrid grid(2 + int(random() % 30), 2 + int(random() % 30), 0);
  for (float& z : grid.values()) {
    z = round % 3 == 0 ? float(random() % 2 * 1000) : float(random() % 1000) / 7;
    if (round % 4 == 1 && random() % 12 == 0) z = HeightGrid::kVoid;
  }
  return grid;
}

HeightGrid terraced_grid(std::mt19937& random, unsigned sides, unsigned void_in, unsigned heights,
                         int step) {
  HeightGrid grid(2 + int(random() % sides), 2 + int(random() % sides));
  for (float& z : grid.values())
    z = random() % void_in == 0 ? HeightGrid::kVoid : float(int(random() % heights) * step);
  grid.at(0, 0) = 1;
  return grid;
}

std::string testdata(const std::string& name) { return std::string(TIND_TESTDATA) + "/" + name; }

std::string shared_data(const std::string& name) {
  const std::string path = std::string(TIND_SHARED_DATA) + "/" + name;
  return std::filesystem::exists(path) ? path : std::string();
}

std::shared_ptr<const Environment> environment() {
  static const auto shared = std::make_shared<const Environment>(TIND_SHARE);
  return shared;
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
