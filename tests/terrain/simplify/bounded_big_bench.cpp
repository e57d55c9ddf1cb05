// `bounded` over a DEM far larger than memory needs to be: time per sample and peak memory of 100
// million samples beside 1 million. The terrain is made while it is read: mirrored copies of a real
// DEM, with fractal detail on top so that no two copies are alike.
//
//   bounded_big_bench [--samples 1e6,1e8] [--eps M] [--effort fast] [--threads N] [DEM]
//   bounded_big_bench --write FILE.bil --samples 1e8 [DEM]     the same terrain as a file
//   gdal_translate FILE.bil FILE.tif && tind simplify FILE.tif --method bounded --max-error 20 ...
//
// Time is that of simplification without the making of heights. The result is measured by rows too.

#include <cmath>
#include <cstdio>
#include <fstream>

#include "server/cli/program/peak_memory.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/bounded/bounded.h"
#include "tests/support/bench.h"

namespace {

using namespace tind;
using namespace tind::test;

/// 0..1, the same for the same lattice point.
double random_at(std::uint32_t x, std::uint32_t y) {
  std::uint32_t h = x * 0x9e3779b1u ^ (y * 0x85ebca77u + 0x1b873593u);
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return double(h ^ (h >> 15)) / 4294967296.0;
}

/// Noise interpolated between lattice points `step` posts apart.
double noise(int col, int row, int step) {
  const double x = double(col) / step, y = double(row) / step;
  const auto i = std::uint32_t(x), j = std::uint32_t(y);
  const double u = x - i, v = y - j, su = u * u * (3 - 2 * u), sv = v * v * (3 - 2 * v);
  const double top = random_at(i, j) * (1 - su) + random_at(i + 1, j) * su;
  const double low = random_at(i, j + 1) * (1 - su) + random_at(i + 1, j + 1) * su;
  return top * (1 - sv) + low * sv - 0.5;
}

class EndlessTerrain {
 public:
  EndlessTerrain(const HeightGrid& tile, int side) : tile_(tile), side_(side) {
    for (const float z : tile.values())
      if (!std::isnan(z)) floor_ = std::min(floor_, z);
  }

  double seconds = 0;  // spent on making heights

  HeightRows rows() {
    return {side_, side_, [this](int first, int count) -> Result<HeightGrid> {
              HeightGrid part(side_, count);
              seconds += seconds_of([&] {
                for (int r = 0; r < count; ++r)
                  for (int c = 0; c < side_; ++c) part.at(c, r) = height(c, first + r);
              });
              return part;
            }};
  }

 private:
  const HeightGrid& tile_;
  int side_;
  float floor_ = 1e9f;

  static int mirrored(int i, int n) {
    const int k = i % (2 * n - 2);
    return k < n ? k : 2 * n - 2 - k;
  }
  float height(int col, int row) const {
    const float z = tile_.at(mirrored(col, tile_.cols()), mirrored(row, tile_.rows()));
    const double base = std::isnan(z) ? floor_ : z;
    return float(base + 24 * noise(col, row, 64) + 6 * noise(col, row, 16) + noise(col, row, 3));
  }
};

struct Case {
  double samples, eps;
  Effort effort;
  int threads;
};

double run(const BenchDem& dem, const Case& c) {
  const int side = int(std::lround(std::sqrt(c.samples)));
  EndlessTerrain terrain(dem.terrain.grid, side);
  RunOptions o;
  o.stop.max_error_m = c.eps;
  o.threads = c.threads;
  cli::PeakMemory::forget();
  Result<Simplified> made;
  const double all = seconds_of(
      [&] { made = simplify_bounded_rows(terrain.rows(), 30, 30, {.effort = c.effort}, o, {}); });
  if (!made) {
    fmt::print(stderr, "{}\n", made.error().what);
    std::exit(1);
  }
  const double memory = cli::PeakMemory::megabytes();
  const double seconds = all - terrain.seconds;
  const double per_sample = seconds * 1e9 / (double(side) * side);
  const auto e = vertical_error_in_strips(made->tin, side, side, terrain.rows().read, c.threads);
  const double mesh_mb = double(made->tin.vertices.size() * sizeof(Vec3) +
                                made->tin.triangles.size() * sizeof(Triangle)) /
                         1e6;
  fmt::print(
      "{} x {} samples ({:.0f} MB as floats), {}, max error {:g} m: {} triangles ({:.0f} MB), "
      "{:.1f} s, {:.0f} ns a sample, peak memory (VmHWM) {:.0f} MB; max {:.6f} m, flipped {}, "
      "uncovered {}\n",
      side, side, double(side) * side * 4e-6, name_of(c.effort), c.eps, made->tin.triangles.size(),
      mesh_mb, seconds, per_sample, memory, e->max_m, check_validity(made->tin).flipped,
      e->uncovered);
  std::fflush(stdout);
  return per_sample;
}

/// Heights as 32-bit floats with a header that GDAL reads.
int write(const BenchDem& dem, const std::string& path, double samples) {
  const int side = int(std::lround(std::sqrt(samples)));
  EndlessTerrain terrain(dem.terrain.grid, side);
  const HeightRows rows = terrain.rows();
  std::ofstream out(path, std::ios::binary);
  for (int first = 0; first < side; first += 64) {
    const auto part = rows.read(first, std::min(64, side - first));
    out.write(reinterpret_cast<const char*>(part->values().data()),
              std::streamsize(part->size() * sizeof(float)));
  }
  std::ofstream header(std::filesystem::path(path).replace_extension(".hdr"));
  header << "NROWS " << side << "\nNCOLS " << side
         << "\nNBANDS 1\nNBITS 32\nPIXELTYPE FLOAT\nBYTEORDER I\nLAYOUT BIL\n"
         << "ULXMAP 0\nULYMAP " << side * 30.0 << "\nXDIM 30\nYDIM 30\n";
  return out && header ? 0 : 1;
}

std::vector<double> numbers(const char* at) {
  std::vector<double> all;
  for (char* end = nullptr; *at; at = *end ? end + 1 : end) all.push_back(std::strtod(at, &end));
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<double> sizes = {1e6, 1e8};
  Case c{0, 20, Effort::fast, 1};
  std::string path, target;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--samples" && i + 1 < argc)
      sizes = numbers(argv[++i]);
    else if (word == "--eps" && i + 1 < argc)
      c.eps = std::strtod(argv[++i], nullptr);
    else if (word == "--effort" && i + 1 < argc)
      c.effort = enum_named<Effort>(argv[++i]).value_or(c.effort);
    else if (word == "--threads" && i + 1 < argc)
      c.threads = std::atoi(argv[++i]);
    else if (word == "--write" && i + 1 < argc)
      target = argv[++i];
    else
      path = word;
  }
  if (path.empty()) path = default_dem("bigtujunga.tif");
  if (path.empty()) path = testdata("bigtujunga_crop.tif");
  const BenchDem dem = load_dem(path);
  if (!target.empty()) return write(dem, target, sizes.back());
  double first = 0;
  for (const double size : sizes) {
    c.samples = size;
    const double per_sample = run(dem, c);
    if (first == 0) first = per_sample;
    if (size != sizes[0]) fmt::print("time per sample: {:.2f} of the first\n", per_sample / first);
  }
}
